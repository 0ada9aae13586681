//! Units as they stand in names: `error_mean_mm` is in millimetres.

/// What names end in, and the unit as people write it; of two that fit the longer one comes first.
const UNITS: [(&str, &str); 21] = [
    ("_rad_s2", "rad/s2"),
    ("_rad_s3", "rad/s3"),
    ("_mm_s2", "mm/s2"),
    ("_nm_rad", "N m/rad"),
    ("_nm_ms", "N m/ms"),
    ("_mm_s", "mm/s"),
    ("_mm_n", "mm/N"),
    ("_n_m", "N/m"),
    ("_percent", "%"),
    ("_deg", "deg"),
    ("_mrad", "mrad"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_db", "dB"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_nm", "N m"),
    ("_px", "px"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
];

/// The unit that a name says it is in: at its end, or before `_p95` and `_max`. `None` for plain numbers.
pub fn unit_of_name(name: &str) -> Option<&'static str> {
    let name = ["_p95", "_max"].iter().find_map(|statistic| name.strip_suffix(statistic)).unwrap_or(name);
    UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_their_units() {
        for (name, unit) in [
            ("error_mean_mm", Some("mm")),
            ("pose_error_mm_p95", Some("mm")),
            ("torque_rate_nm_ms", Some("N m/ms")),
            ("compliance_mm_n", Some("mm/N")),
            ("stiffness_n_m", Some("N/m")),
            ("n", None),
            ("side_error_max", None),
            ("lost_contacts", None),
        ] {
            assert_eq!(unit_of_name(name), unit, "{name}");
        }
    }
}
