//! record.mcap: the record of a run as an MCAP file (<https://mcap.dev>), which Foxglove and others open.
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use serde::Serialize;
use serde_json::json;

use crate::math::Pose;
use crate::plan::SegmentKind;
use crate::twin::{ArmSample, BaseSample, BaseStand, Event, EventKind, Record};

/// Why a record can't be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordFileError {
    /// The MCAP writer refuses.
    #[error("record.mcap: {0}")]
    Mcap(#[from] McapError),
    /// A message can't be put in JSON.
    #[error("record.mcap: {0}")]
    Json(#[from] serde_json::Error),
}

#[derive(Serialize)]
struct Joints<'a> {
    time: f64,
    position: &'a [f64],
    velocity: &'a [f64],
    #[serde(skip_serializing_if = "Option::is_none")]
    torque: Option<&'a [f64]>,
}

#[derive(Serialize)]
struct Pen {
    time: f64,
    segment: SegmentKind,
    tip: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    desired: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    normal_force: Option<f64>,
}

#[derive(Serialize)]
struct Base {
    time: f64,
    driving: bool,
    position: [f64; 3],
    orientation: [f64; 4],
}

#[derive(Serialize)]
struct Stand {
    time: f64,
    position: [f64; 3],
    orientation: [f64; 4],
    believed_position: [f64; 3],
    believed_orientation: [f64; 4],
}

#[derive(Serialize)]
struct Happened<'a> {
    time: f64,
    arm: usize,
    event: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    layer: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stroke: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ink: Option<&'a str>,
}

/// Something with a time on a channel.
enum Message<'a> {
    Sample(usize, &'a ArmSample),
    Base(usize, &'a BaseSample),
    Stand(usize, &'a BaseStand),
    Event(&'a Event),
}

/// Writes the samples and events of a record in the order of their simulated time, which is the log time (ns).
///
/// Channels, in JSON: `/arm0/joints` (positions, rad; speeds, rad/s; acting torques, N m), `/arm0/pen` (tip and desired tip, m,
/// world; force of the canvas on the pen, N, world; normal force, N), the same for each further arm, and `/events`. Of an arm on a base,
/// `/arm0/base` (position, m, and orientation, quaternion x y z w, world) and `/arm0/stands` (where it came to believe that it stands).
pub fn write_record<W: Write + Seek>(record: &Record, to: W) -> Result<(), RecordFileError> {
    let options =
        WriteOptions::new().compression(None).library(concat!("calamus ", env!("CARGO_PKG_VERSION"))).profile("");
    let mut writer = Writer::with_options(to, options)?;
    let joints = schema(
        &mut writer,
        "calamus.Joints",
        &[("position", numbers()), ("velocity", numbers()), ("torque", numbers())],
    )?;
    let pen = schema(
        &mut writer,
        "calamus.Pen",
        &[
            ("segment", json!({ "type": "string" })),
            ("tip", numbers()),
            ("desired", numbers()),
            ("force", numbers()),
            ("normal_force", json!({ "type": "number" })),
        ],
    )?;
    let event = schema(
        &mut writer,
        "calamus.Event",
        &[
            ("arm", json!({ "type": "integer" })),
            ("event", json!({ "type": "string" })),
            ("layer", json!({ "type": "integer" })),
            ("stroke", json!({ "type": "integer" })),
            ("ink", json!({ "type": "string" })),
        ],
    )?;
    let base = [("driving", json!({ "type": "boolean" })), ("position", numbers()), ("orientation", numbers())];
    let pose = ["position", "orientation", "believed_position", "believed_orientation"].map(|name| (name, numbers()));
    let mut channels = Vec::new();
    for (i, arm) in record.arms.iter().enumerate() {
        let metadata: BTreeMap<String, String> =
            [("arm".to_string(), arm.name.clone()), ("joints".to_string(), arm.joints.join(","))].into();
        let joints = writer.add_channel(joints, &format!("/arm{i}/joints"), "json", &metadata)?;
        let pen = writer.add_channel(pen, &format!("/arm{i}/pen"), "json", &BTreeMap::new())?;
        let on_base = if arm.base.is_empty() {
            None
        } else {
            let (base, stand) =
                (schema(&mut writer, "calamus.Base", &base)?, schema(&mut writer, "calamus.Stand", &pose)?);
            let base = writer.add_channel(base, &format!("/arm{i}/base"), "json", &BTreeMap::new())?;
            Some((base, writer.add_channel(stand, &format!("/arm{i}/stands"), "json", &BTreeMap::new())?))
        };
        channels.push((joints, pen, on_base));
    }
    let events = writer.add_channel(event, "/events", "json", &BTreeMap::new())?;

    let mut messages: Vec<(u64, Message)> = Vec::new();
    for (i, arm) in record.arms.iter().enumerate() {
        messages.extend(arm.samples.iter().map(|s| (nanoseconds(s.time), Message::Sample(i, s))));
        messages.extend(arm.base.iter().map(|s| (nanoseconds(s.time), Message::Base(i, s))));
        if !arm.base.is_empty() {
            messages.extend(arm.stands.iter().map(|s| (nanoseconds(s.time), Message::Stand(i, s))));
        }
    }
    messages.extend(record.events.iter().map(|e| (nanoseconds(e.time), Message::Event(e))));
    messages.sort_by_key(|(time, _)| *time);
    let mut sequence = 0;
    let mut send = |channel_id: u16, time: u64, data: &[u8]| {
        sequence += 1;
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, data)
    };
    for (time, message) in &messages {
        match message {
            Message::Sample(arm, s) => {
                let (joints, pen, _) = channels[*arm];
                let data = Joints { time: s.time, position: &s.q, velocity: &s.qd, torque: s.torque.as_deref() };
                send(joints, *time, &serde_json::to_vec(&data)?)?;
                let data = Pen {
                    time: s.time,
                    segment: s.segment,
                    tip: s.tip.coords.into(),
                    desired: s.tip_desired.map(|p| p.coords.into()),
                    force: s.force.map(Into::into),
                    normal_force: s.normal_force,
                };
                send(pen, *time, &serde_json::to_vec(&data)?)?;
            }
            Message::Base(arm, s) => {
                let (position, orientation) = parts(&s.pose);
                let data = Base { time: s.time, driving: s.driving, position, orientation };
                if let Some((base, _)) = channels[*arm].2 {
                    send(base, *time, &serde_json::to_vec(&data)?)?;
                }
            }
            Message::Stand(arm, s) => {
                let (position, orientation) = parts(&s.pose);
                let (believed_position, believed_orientation) = parts(&s.believed);
                let data = Stand { time: s.time, position, orientation, believed_position, believed_orientation };
                if let Some((_, stands)) = channels[*arm].2 {
                    send(stands, *time, &serde_json::to_vec(&data)?)?;
                }
            }
            Message::Event(e) => send(events, *time, &serde_json::to_vec(&happened(e)?)?)?,
        }
    }
    writer.finish()?;
    Ok(())
}

/// Position (m) and orientation (quaternion x y z w).
fn parts(pose: &Pose) -> ([f64; 3], [f64; 4]) {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}

/// An event in the flat form of its channel.
fn happened(event: &Event) -> Result<Happened<'_>, serde_json::Error> {
    let (name, ink) = match &event.kind {
        EventKind::Segment { kind } => (serde_json::to_value(kind)?.as_str().unwrap_or_default().to_string(), None),
        EventKind::Touch => ("touch".into(), None),
        EventKind::Leave => ("leave".into(), None),
        EventKind::PenChanged { ink } => ("pen_changed".into(), Some(ink.as_str())),
        EventKind::PenFetched { ink } => ("pen_fetched".into(), Some(ink.as_str())),
        EventKind::PenReturned { ink } => ("pen_returned".into(), Some(ink.as_str())),
        EventKind::Picture => ("picture".into(), None),
        EventKind::PenLost { ink } => ("pen_lost".into(), Some(ink.as_str())),
    };
    let stroke = event.stroke;
    Ok(Happened {
        time: event.time,
        arm: event.arm,
        event: name,
        layer: stroke.map(|s| s.layer),
        stroke: stroke.map(|s| s.index),
        ink,
    })
}

/// Log time of a simulated time.
fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}

fn numbers() -> serde_json::Value {
    json!({ "type": "array", "items": { "type": "number" } })
}

/// A JSON schema of an object with a time and the given properties.
fn schema<W: Write + Seek>(
    writer: &mut Writer<W>,
    name: &str,
    properties: &[(&str, serde_json::Value)],
) -> Result<u16, RecordFileError> {
    let mut all = serde_json::Map::new();
    all.insert("time".into(), json!({ "type": "number" }));
    all.extend(properties.iter().map(|(name, schema)| ((*name).to_string(), schema.clone())));
    let text = serde_json::to_vec(&json!({ "title": name, "type": "object", "properties": all }))?;
    Ok(writer.add_schema(name, "jsonschema", &text)?)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::sample::record;
    use super::*;

    fn bytes(record: &Record) -> Vec<u8> {
        let mut buffer = Cursor::new(Vec::new());
        write_record(record, &mut buffer).unwrap();
        buffer.into_inner()
    }

    #[test]
    fn every_sample_and_event_is_read_back_in_time_order() {
        let record = record();
        let file = bytes(&record);
        let messages: Vec<_> = mcap::MessageStream::new(&file).unwrap().map(|m| m.unwrap()).collect();
        assert_eq!(messages.len(), 2 * record.arms[0].samples.len() + record.events.len());
        assert!(messages.windows(2).all(|w| w[0].log_time <= w[1].log_time));
        let pen = messages.iter().filter(|m| m.channel.topic == "/arm0/pen").nth(7).unwrap();
        let value: serde_json::Value = serde_json::from_slice(&pen.data).unwrap();
        assert_eq!(value["normal_force"].as_f64(), record.arms[0].samples[7].normal_force);
        assert_eq!(pen.log_time, (record.arms[0].samples[7].time * 1e9).round() as u64);
    }

    #[test]
    fn where_a_base_stands_and_believes_to_is_read_back() {
        let mut record = record();
        let pose = |x: f64| Pose::new([x, 0.5, 0.1].into(), [0.0, 0.0, 1.0].into());
        let base = |time: f64| BaseSample { time, segment: SegmentKind::Wait, driving: time < 0.15, pose: pose(time) };
        record.arms[0].base = vec![base(0.1), base(0.2)];
        record.arms[0].stands = vec![BaseStand { time: 0.2, pose: pose(0.2), believed: pose(0.21) }];
        let file = bytes(&record);
        let of = |topic: &str| -> Vec<serde_json::Value> {
            let all = mcap::MessageStream::new(&file).unwrap().map(|m| m.unwrap());
            all.filter(|m| m.channel.topic == topic).map(|m| serde_json::from_slice(&m.data).unwrap()).collect()
        };
        let (base, stands) = (of("/arm0/base"), of("/arm0/stands"));
        assert_eq!(base.iter().map(|b| b["driving"].as_bool().unwrap()).collect::<Vec<_>>(), [true, false]);
        assert_eq!(base[1]["position"], json!([0.2, 0.5, 0.1]));
        assert_eq!(base[1]["orientation"][3], json!((0.5f64).cos()));
        assert_eq!((stands.len(), &stands[0]["believed_position"][0]), (1, &json!(0.21)));
    }

    #[test]
    fn equal_records_give_equal_files() {
        assert_eq!(bytes(&record()), bytes(&record()));
    }
}
