//! A driven base: four mecanum wheels under an arm, as a robot file's `[base]` gives them.
//!
//! ```toml
//! [base]
//! urdf = "ridgeback.urdf"
//! base_link = "base_link"                # its frame stands on the floor: x ahead, z up
//! mount_link = "arm_mount"               # where the arm's base link stands
//! wheels = ["front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"]
//! rocker = "front"                       # the axle that turns freely about x: "front", "rear" or "none"
//! radius_mm = 75.9
//! ```
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::urdf::load_rigid;
use super::{ArmModel, JointVector, LinkModel, RobotError, UrdfOptions};
use crate::diagnostic;
use crate::math::Pose;

/// Wheels of a base: front left, front right, rear left, rear right.
pub const WHEELS: usize = 4;

/// Where a base stands on a level floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BasePose {
    /// Place of the base's frame, m, world.
    pub x: f64,
    /// The same to the left of the world's x axis, m.
    pub y: f64,
    /// Heading from the world's x axis, rad, counter-clockwise; not wrapped.
    pub yaw: f64,
}

impl BasePose {
    /// The frame on a level floor at height 0.
    pub fn pose(&self) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        Pose::from_parts(Translation3::new(self.x, self.y, 0.0), turn)
    }

    /// What of a pose in space is seen from above: place and heading of the x axis.
    pub fn of(pose: &Pose) -> Self {
        let ahead = pose.rotation * Vector3::x();
        Self { x: pose.translation.x, y: pose.translation.y, yaw: ahead.y.atan2(ahead.x) }
    }

    /// Whether all of it is finite.
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.yaw.is_finite()
    }
}

/// One wheel of a base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelModel {
    /// Middle of the wheel, m, base frame; the axle lies along y.
    pub hub: Point3<f64>,
    /// Direction of the axis of the roller that stands on the floor, base frame, unit: along it the wheel holds.
    pub roller: Vector2<f64>,
}

/// Motors of the wheels, and the loops round them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelMotor {
    /// Largest torque at a wheel, N m.
    pub torque: f64,
    /// Inertia of wheel and rotor about the axle, kg m2.
    pub inertia: f64,
    /// Gain of the velocity loop, N m s/rad.
    pub velocity_gain: f64,
    /// Gain on the integral of its error while the base drives, N m/rad; 0 is a proportional loop.
    pub integral_gain: f64,
    /// The same while it is parked: the wheel is held in its place, N m/rad.
    pub hold_gain: f64,
}

/// How a roller and the floor hold each other: a brush along the roller's axis, rolling friction across it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tyre {
    /// Coulomb friction of roller and floor.
    pub friction: f64,
    /// Rolling resistance of a roller, share of the load.
    pub rolling_resistance: f64,
    /// Stiffness of the contact along the roller's axis, N/m.
    pub stiffness: f64,
    /// Its damping, N s/m.
    pub damping: f64,
    /// Half the length of the contact, m: bristles are renewed as the wheel travels over it.
    pub half_length: f64,
}

/// How a base stands on its wheels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelSprings {
    /// Upright stiffness of a wheel, N/m.
    pub stiffness: f64,
    /// Damping ratio of the first mode; others are damped in proportion to their stiffness.
    pub damping_ratio: f64,
    /// The axle that turns freely about x.
    pub rocker: Rocker,
}

/// Which axle turns freely about x, so that all wheels stand on an uneven floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rocker {
    /// The front axle.
    Front,
    /// The rear axle.
    Rear,
    /// Neither: four springs.
    None,
}

/// What a base can do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseLimits {
    /// Speed, m/s.
    pub speed: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate: f64,
    /// Acceleration, m/s2.
    pub acceleration: f64,
    /// Yaw acceleration, rad/s2.
    pub yaw_acceleration: f64,
}

/// A driven base without the arm on it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BaseModel {
    /// Name, as in the URDF.
    pub name: String,
    /// Chassis, axles, wheels and mount as one body, base frame: on the floor, x ahead, z up.
    pub body: LinkModel,
    /// Where the arm's base link stands.
    pub base_from_arm: Pose,
    /// Front left, front right, rear left, rear right.
    pub wheels: [WheelModel; WHEELS],
    /// Radius of the wheels, m.
    pub radius: f64,
    /// Motors.
    pub motor: WheelMotor,
    /// Contact with the floor.
    pub tyre: Tyre,
    /// Springs.
    pub springs: WheelSprings,
    /// What it can do.
    pub limits: BaseLimits,
    /// Joints of the arm in which it rides, rad.
    pub transport: JointVector,
    /// Where it stands at first.
    pub start: BasePose,
}

impl BaseModel {
    /// Stands `arm` on this base at `pose`: chassis and all become part of the arm's link 0, seen and kept clear of.
    pub(super) fn carry(&self, arm: &mut ArmModel) {
        let arm_from_base = self.base_from_arm.inverse();
        let foot = &mut arm.links[0];
        foot.inertia = foot.inertia.joined(&self.body.inertia.seen_from(&arm_from_base));
        foot.capsules.extend(self.body.capsules.iter().map(|c| c.seen_from(&arm_from_base)));
        foot.visuals.extend(self.body.visuals.iter().cloned().map(|mut v| {
            v.link_from_visual = arm_from_base * v.link_from_visual;
            v
        }));
        self.stand(arm, &self.start);
    }

    /// Puts the arm's base link where the base at `pose` carries it.
    pub fn stand(&self, arm: &mut ArmModel, pose: &BasePose) {
        arm.world_from_base = pose.pose() * self.base_from_arm;
    }

    /// Half the distances of the wheels along x and y, m, as means over the wheels.
    pub fn half_track(&self) -> [f64; 2] {
        let mean = |of: fn(&WheelModel) -> f64| self.wheels.iter().map(of).sum::<f64>() / WHEELS as f64;
        [mean(|w| w.hub.x.abs()), mean(|w| w.hub.y.abs())]
    }
}

/// `[base]` as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BaseFile {
    urdf: PathBuf,
    base_link: Option<String>,
    mount_link: String,
    wheels: [String; WHEELS],
    rocker: Rocker,
    radius_mm: f64,
    roller_deg: f64,
    pub(super) transport_deg: Vec<f64>,
    #[serde(default)]
    pose: StandFile,
    max_speed_mm_s: f64,
    max_yaw_deg_s: f64,
    max_acceleration_mm_s2: f64,
    max_yaw_acceleration_deg_s2: f64,
    motor: MotorFile,
    tyre: TyreFile,
    mount: MountFile,
    #[serde(default)]
    packages: BTreeMap<String, PathBuf>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct StandFile {
    #[serde(default)]
    xy_mm: [f64; 2],
    #[serde(default)]
    yaw_deg: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorFile {
    torque_nm: f64,
    inertia_kg_m2: f64,
    velocity_gain: f64,
    integral_gain: f64,
    hold_gain: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TyreFile {
    friction: f64,
    rolling_resistance: f64,
    stiffness_n_m: f64,
    damping_n_s_m: f64,
    half_length_mm: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MountFile {
    stiffness_n_m: f64,
    damping_ratio: f64,
}

impl BaseFile {
    /// The base, paths seen from `file`'s folder; `transport` has been read by the arm's limits.
    pub(super) fn read(
        &self,
        text: &str,
        file: &Path,
        transport: JointVector,
    ) -> Result<(BaseModel, Vec<String>), RobotError> {
        let wrong = |key: &str, message: String| {
            RobotError::from(diagnostic::invalid(text, file, &format!("base.{key}"), message))
        };
        self.check().map_err(|(key, message)| wrong(key, message))?;
        let folder = file.parent().unwrap_or(Path::new("."));
        let options = UrdfOptions {
            base_link: self.base_link.clone(),
            tip_link: Some(self.mount_link.clone()),
            packages: self.packages.iter().map(|(name, dir)| (name.clone(), folder.join(dir))).collect(),
            freeze: BTreeMap::new(),
        };
        let links: Vec<&str> = self.wheels.iter().map(String::as_str).chain([self.mount_link.as_str()]).collect();
        let (body, poses) = load_rigid(&folder.join(&self.urdf), &options, &links).map_err(|e| match &e {
            RobotError::NoSuchName { option: "base_link", .. } => wrong("base_link", e.to_string()),
            RobotError::NoSuchName { name, .. } if *name == self.mount_link => wrong("mount_link", e.to_string()),
            RobotError::NoSuchName { .. } => wrong("wheels", e.to_string()),
            _ => e,
        })?;
        let hubs: Vec<Point3<f64>> = poses[..WHEELS].iter().map(|p| p.translation.vector.into()).collect();
        self.check_hubs(&hubs).map_err(|message| wrong("wheels", message))?;
        let (sin, cos) = self.roller_deg.to_radians().sin_cos();
        // front left and rear right hold along (1, -1), the others along (1, 1), so that all four can drive the base sideways and turn it
        let wheel = |i: usize| {
            let side = if i == 0 || i == 3 { -1.0 } else { 1.0 };
            WheelModel { hub: hubs[i], roller: Vector2::new(sin, side * cos) }
        };
        let [x, y] = self.pose.xy_mm.map(|v| v * 1e-3);
        let name = body.model.name.clone();
        let mut links = body.model.links;
        let model = BaseModel {
            name,
            body: links.swap_remove(0),
            base_from_arm: poses[WHEELS],
            wheels: [0, 1, 2, 3].map(wheel),
            radius: self.radius_mm * 1e-3,
            motor: self.motor.model(),
            tyre: self.tyre.model(),
            springs: WheelSprings {
                stiffness: self.mount.stiffness_n_m,
                damping_ratio: self.mount.damping_ratio,
                rocker: self.rocker,
            },
            limits: BaseLimits {
                speed: self.max_speed_mm_s * 1e-3,
                yaw_rate: self.max_yaw_deg_s.to_radians(),
                acceleration: self.max_acceleration_mm_s2 * 1e-3,
                yaw_acceleration: self.max_yaw_acceleration_deg_s2.to_radians(),
            },
            transport,
            start: BasePose { x, y, yaw: self.pose.yaw_deg.to_radians() },
        };
        if let Some(defect) = model.body.inertia.defect() {
            return Err(wrong("urdf", format!("the base's body: {defect}")));
        }
        Ok((model, body.notes))
    }

    /// The key that is wrong, and what would be right.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let positive = [
            ("radius_mm", self.radius_mm),
            ("max_speed_mm_s", self.max_speed_mm_s),
            ("max_yaw_deg_s", self.max_yaw_deg_s),
            ("max_acceleration_mm_s2", self.max_acceleration_mm_s2),
            ("max_yaw_acceleration_deg_s2", self.max_yaw_acceleration_deg_s2),
            ("motor.torque_nm", self.motor.torque_nm),
            ("motor.inertia_kg_m2", self.motor.inertia_kg_m2),
            ("motor.velocity_gain", self.motor.velocity_gain),
            ("tyre.stiffness_n_m", self.tyre.stiffness_n_m),
            ("tyre.half_length_mm", self.tyre.half_length_mm),
            ("mount.stiffness_n_m", self.mount.stiffness_n_m),
        ];
        if let Some((key, v)) = positive.iter().find(|(_, v)| !v.is_finite() || *v <= 0.0) {
            return Err((key, format!("{v} must be a positive number")));
        }
        let least_zero = [
            ("motor.integral_gain", self.motor.integral_gain),
            ("motor.hold_gain", self.motor.hold_gain),
            ("tyre.friction", self.tyre.friction),
            ("tyre.rolling_resistance", self.tyre.rolling_resistance),
            ("tyre.damping_n_s_m", self.tyre.damping_n_s_m),
        ];
        if let Some((key, v)) = least_zero.iter().find(|(_, v)| !v.is_finite() || *v < 0.0) {
            return Err((key, format!("{v} must be 0 or more")));
        }
        if !(0.0..1.0).contains(&self.mount.damping_ratio) {
            return Err(("mount.damping_ratio", "a damping ratio lies between 0 and 1".into()));
        }
        if !(5.0..=85.0).contains(&self.roller_deg) {
            let message = format!(
                "{} deg is no roller's angle: give 5 to 85 deg between roller and axle; 45 is usual",
                self.roller_deg
            );
            return Err(("roller_deg", message));
        }
        if !self.pose.xy_mm.iter().chain([&self.pose.yaw_deg]).all(|v| v.is_finite()) {
            return Err(("pose", "the pose must be made of finite numbers".into()));
        }
        Ok(())
    }

    /// Wheels that stand where their names say, on the floor of the base's frame.
    fn check_hubs(&self, hubs: &[Point3<f64>]) -> Result<(), String> {
        for (i, hub) in hubs.iter().enumerate() {
            let (ahead, left) = (if i < 2 { 1.0 } else { -1.0 }, if i % 2 == 0 { 1.0 } else { -1.0 });
            if hub.x * ahead <= 0.0 || hub.y * left <= 0.0 {
                let place = ["front left", "front right", "rear left", "rear right"][i];
                return Err(format!(
                    "`{}` should be the {place} wheel but lies at x {:.3}, y {:.3} m",
                    self.wheels[i], hub.x, hub.y
                ));
            }
            if (hub.z - self.radius_mm * 1e-3).abs() > 1e-3 {
                let stands = hub.z * 1e3;
                return Err(format!(
                    "wheel `{}` of radius {} mm has its middle {stands:.1} mm above the base link, whose frame should stand on the floor",
                    self.wheels[i], self.radius_mm
                ));
            }
        }
        Ok(())
    }
}

impl MotorFile {
    fn model(&self) -> WheelMotor {
        WheelMotor {
            torque: self.torque_nm,
            inertia: self.inertia_kg_m2,
            velocity_gain: self.velocity_gain,
            integral_gain: self.integral_gain,
            hold_gain: self.hold_gain,
        }
    }
}

impl TyreFile {
    fn model(&self) -> Tyre {
        Tyre {
            friction: self.friction,
            rolling_resistance: self.rolling_resistance,
            stiffness: self.stiffness_n_m,
            damping: self.damping_n_s_m,
            half_length: self.half_length_mm * 1e-3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Cell;

    fn robots() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots")
    }

    #[test]
    fn the_ridgeback_has_the_published_sizes_and_carries_its_arm() {
        let arm = Cell::load(&robots().join("iiwa_ridgeback.toml")).expect("loads").arms.remove(0);
        let base = arm.base.as_ref().expect("has a base");
        assert!((base.base_from_arm.translation.vector - Vector3::new(0.12, 0.0, 0.731)).norm() < 1e-12);
        assert_eq!(arm.model.world_from_base, base.base_from_arm);
        assert!((base.body.inertia.mass - (165.304 + 2.0 * 10.267 + 4.0 * 2.3 + 40.0)).abs() < 1e-9);
        let [x, y] = base.half_track();
        assert!((x - 0.319).abs() < 1e-12 && (y - 0.2755).abs() < 1e-12);
        assert!(base.wheels.iter().all(|w| (w.hub.z - 0.0759).abs() < 1e-12 && (w.roller.norm() - 1.0).abs() < 1e-12));
        assert!(arm.model.links[0].inertia.mass > base.body.inertia.mass + 4.0, "the arm's foot is part of link 0");
        assert!((0.0..0.62).contains(&base.body.inertia.com.z));
    }

    #[test]
    fn an_arm_follows_its_base() {
        let arm = Cell::load(&robots().join("iiwa_ridgeback.toml")).expect("loads").arms.remove(0);
        let (mut model, base) = (arm.model, arm.base.expect("has a base"));
        let pose = BasePose { x: 5.0, y: -3.0, yaw: 2.5 };
        base.stand(&mut model, &pose);
        let at = model.world_from_base * base.base_from_arm.inverse();
        let seen = BasePose::of(&at);
        assert!((seen.x - 5.0).abs() < 1e-12 && (seen.y + 3.0).abs() < 1e-12 && (seen.yaw - 2.5).abs() < 1e-12);
    }

    #[test]
    fn mistakes_in_a_base_are_named_at_their_line() {
        let text = std::fs::read_to_string(robots().join("iiwa_ridgeback.toml")).expect("is there");
        let file = robots().join("wrong.toml");
        for (from, to, key, expected) in [
            ("radius_mm = 75.9", "radius_mm = 60", "wheels", "should stand on the floor"),
            ("radius_mm = 75.9", "radius_mm = -1", "radius_mm", "must be a positive number"),
            ("roller_deg = 45", "roller_deg = 90", "roller_deg", "no roller's angle"),
            ("\"front_left_wheel\"", "\"front_right_wheel\"", "wheels", "should be the front left wheel"),
            ("\"front_left_wheel\"", "\"front_left_wheal\"", "wheels", "did you mean `front_left_wheel`?"),
            ("\"arm_mount\"", "\"arm_mound\"", "mount_link", "did you mean `arm_mount`?"),
            ("friction = 0.6", "friction = -0.6", "friction", "must be 0 or more"),
            ("transport_deg = [0, 24.94,", "transport_deg = [0, 240,", "transport_deg", "outside its limits"),
            ("rocker = \"front\"", "rocker = \"middle\"", "rocker", "unknown value"),
            ("hold_gain = 2000", "hold_again = 2000", "hold_again", "did you mean `hold_gain`?"),
        ] {
            let wrong = text.replacen(from, to, 1);
            assert_ne!(wrong, text, "{from}");
            let error = Cell::parse(&wrong, &file).expect_err(to).to_string();
            let set = |l: &str| l.split_once('=').is_some_and(|(k, _)| k.trim() == key);
            let line = wrong.lines().position(set).expect(key) + 1;
            assert!(error.contains(expected), "{to}: {error}");
            assert!(error.contains(&format!("wrong.toml:{line}: ")), "{to}: {error}");
        }
        let two = text.replacen("[base]", "[[arm]]\nname = \"other\"\nurdf = \"ur5e.urdf\"\nbase_link = \"base_link\"\nflange_link = \"tool0\"\nhome_deg = [0, -90, 0, 0, 0, 0]\nservice_deg = [0, -90, 0, 0, 0, 0]\n\n[base]", 1);
        assert!(Cell::parse(&two, &file).expect_err("two arms").to_string().contains("carries one arm"));
    }
}
