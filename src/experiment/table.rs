//! Rows and summaries as tables: CSV and Parquet.
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::Value;

use crate::measure::MetricPath;
use crate::report::cell;

use super::ExperimentError;
use super::axis::words;
use super::estimate::Estimate;
use super::row::{Row, Status};
use super::summary::{Group, Summary};

/// A column of the results.
enum Column {
    Whole(Vec<u64>),
    Number(Vec<Option<f64>>),
    Text(Vec<Option<String>>),
}

/// The columns of the rows: what identifies a trial, axes, draws, how it ended, figures.
fn columns(rows: &[Row]) -> Vec<(String, Column)> {
    let whole = |f: &dyn Fn(&Row) -> u64| Column::Whole(rows.iter().map(f).collect());
    let text = |f: &dyn Fn(&Row) -> Option<String>| Column::Text(rows.iter().map(f).collect());
    let filled = |s: &String| (!s.is_empty()).then(|| s.clone());
    let mut columns = vec![
        ("trial".to_string(), whole(&|r| r.trial)),
        ("case".to_string(), text(&|r| filled(&r.case))),
        ("cell".to_string(), whole(&|r| r.cell)),
        ("repeat".to_string(), whole(&|r| r.repeat)),
    ];
    type Settings = fn(&Row) -> &BTreeMap<String, Value>;
    let settings: [Settings; 2] = [|r| &r.axes, |r| &r.draws];
    for of in settings {
        let keys: BTreeSet<&String> = rows.iter().flat_map(|r| of(r).keys()).collect();
        columns.extend(keys.into_iter().map(|key| (setting(key), values(rows.iter().map(|r| of(r).get(key))))));
    }
    columns.push(("seed".into(), whole(&|r| r.seed)));
    columns.push(("status".into(), text(&|r| Some(if r.status == Status::Ok { "ok" } else { "failed" }.into()))));
    columns.push(("reason".into(), text(&|r| filled(&r.reason))));
    columns.push(("digest".into(), text(&|r| r.digest.clone())));
    for metric in MetricPath::all() {
        let column: Vec<Option<f64>> = rows.iter().map(|r| r.metrics.get(&metric.path).copied()).collect();
        if column.iter().any(Option::is_some) {
            columns.push((metric.path.clone(), Column::Number(column)));
        }
    }
    columns
}

/// Names of columns that are neither settings nor figures.
const OWN: [&str; 8] = ["trial", "case", "cell", "repeat", "seed", "status", "reason", "digest"];

/// The name of a setting's column: its key, with `set.` before it where a figure or another column is called the same.
fn setting(key: &str) -> String {
    let taken = MetricPath::find(key).is_some() || OWN.contains(&key);
    if taken { format!("set.{key}") } else { key.to_string() }
}

/// Settings as a column: numbers where all of them are, else text.
fn values<'a>(values: impl Iterator<Item = Option<&'a Value>>) -> Column {
    let values: Vec<Option<&Value>> = values.collect();
    if values.iter().flatten().all(|v| v.is_number()) {
        Column::Number(values.iter().map(|v| v.and_then(Value::as_f64)).collect())
    } else {
        Column::Text(values.iter().map(|v| v.map(words)).collect())
    }
}

impl Column {
    /// A field of the column as CSV has it; numbers by their shortest exact form.
    fn field(&self, row: usize) -> String {
        match self {
            Column::Whole(x) => x[row].to_string(),
            Column::Number(x) => x[row].map_or_else(String::new, |x| x.to_string()),
            Column::Text(x) => cell(x[row].as_deref().unwrap_or_default()),
        }
    }
}

/// results.csv: a line a trial.
pub(super) fn results_csv(rows: &[Row]) -> Result<Vec<u8>, ExperimentError> {
    let columns = columns(rows);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let lines = (0..rows.len()).map(|i| columns.iter().map(|(_, c)| c.field(i)).collect::<Vec<_>>());
    let head = columns.iter().map(|(name, _)| name.clone()).collect();
    write_csv(&mut writer, std::iter::once(head).chain(lines)).map_err(|e| failed("results.csv", &e))?;
    writer.into_inner().map_err(|e| failed("results.csv", &e))
}

fn write_csv(writer: &mut csv::Writer<Vec<u8>>, lines: impl Iterator<Item = Vec<String>>) -> Result<(), csv::Error> {
    lines.into_iter().try_for_each(|line| writer.write_record(line))
}

fn failed(what: &'static str, why: &dyn std::fmt::Display) -> ExperimentError {
    ExperimentError::Table { what, why: why.to_string() }
}

/// summary.csv: a line a figure of each group; a group without axes is all of its case.
pub(super) fn summary_csv(summary: &Summary) -> Result<Vec<u8>, ExperimentError> {
    let keys: BTreeSet<&String> = summary.cells.iter().flat_map(|g| g.axes.keys()).collect();
    let head = ["case", "trials", "failures", "figure", "n", "mean", "low", "high", "sd", "median", "min", "max"];
    let mut lines: Vec<Vec<String>> = vec![
        head[..1]
            .iter()
            .map(|s| (*s).to_string())
            .chain(keys.iter().map(|k| setting(k)))
            .chain(head[1..].iter().map(|s| (*s).to_string()))
            .collect(),
    ];
    let mut add = |group: &Group, name: &str, e: &Estimate| {
        let optional = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
        let mut line = vec![cell(&group.case)];
        line.extend(keys.iter().map(|k| group.axes.get(*k).map_or_else(String::new, |v| cell(&words(v)))));
        line.extend([
            group.n.to_string(),
            group.failures.to_string(),
            name.to_string(),
            e.n.to_string(),
            e.mean.to_string(),
        ]);
        line.extend([optional(e.low), optional(e.high)]);
        line.extend([e.sd, e.median, e.min, e.max].map(|x| x.to_string()));
        lines.push(line);
    };
    for group in summary.cases.iter().chain(&summary.cells) {
        group.rates.iter().for_each(|(name, e)| add(group, &format!("rate.{name}"), e));
        for metric in MetricPath::all() {
            if let Some(e) = group.metrics.get(&metric.path) {
                add(group, &metric.path, e);
            }
        }
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    write_csv(&mut writer, lines.into_iter()).map_err(|e| failed("summary.csv", &e))?;
    writer.into_inner().map_err(|e| failed("summary.csv", &e))
}

/// results.parquet: the columns of results.csv, uncompressed, absent fields null.
pub(super) fn results_parquet(rows: &[Row]) -> Result<Vec<u8>, ExperimentError> {
    parquet(&columns(rows), rows.len()).map_err(|e| failed("results.parquet", &e))
}

fn parquet(columns: &[(String, Column)], rows: usize) -> Result<Vec<u8>, ParquetError> {
    let field = |(name, column): &(String, Column)| {
        let (physical, logical, repetition) = match column {
            Column::Whole(_) => (Physical::INT64, None, Repetition::REQUIRED),
            Column::Number(_) => (Physical::DOUBLE, None, Repetition::OPTIONAL),
            Column::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL),
        };
        let build = Type::primitive_type_builder(name, physical).with_logical_type(logical).with_repetition(repetition);
        build.build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("trials").with_fields(fields).build()?);
    let properties = WriterProperties::builder().set_created_by(concat!("calamus ", env!("CARGO_PKG_VERSION")).into());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties.build()))?;
    let mut group = writer.next_row_group()?;
    let mut columns = columns.iter();
    while let (Some(mut to), Some((_, column))) = (group.next_column()?, columns.next()) {
        match (to.untyped(), column) {
            (ColumnWriter::Int64ColumnWriter(w), Column::Whole(x)) => {
                let x: Vec<i64> = x.iter().map(|x| *x as i64).collect();
                w.write_batch(&x, None, None)?;
            }
            (ColumnWriter::DoubleColumnWriter(w), Column::Number(x)) => {
                let levels: Vec<i16> = x.iter().map(|x| i16::from(x.is_some())).collect();
                w.write_batch(&x.iter().flatten().copied().collect::<Vec<_>>(), Some(&levels), None)?;
            }
            (ColumnWriter::ByteArrayColumnWriter(w), Column::Text(x)) => {
                let levels: Vec<i16> = x.iter().map(|x| i16::from(x.is_some())).collect();
                let x: Vec<ByteArray> = x.iter().flatten().map(|s| ByteArray::from(s.as_str())).collect();
                w.write_batch(&x, Some(&levels), None)?;
            }
            _ => return Err(ParquetError::General(format!("a column of {rows} rows has another type than its field"))),
        }
        to.close()?;
    }
    group.close()?;
    writer.into_inner()
}

/// Rows as a map of columns, as a reader of results.csv sees them.
#[cfg(test)]
pub(super) fn read_csv(bytes: &[u8]) -> BTreeMap<String, Vec<String>> {
    let mut reader = csv::Reader::from_reader(bytes);
    let head: Vec<String> = reader.headers().unwrap().iter().map(str::to_string).collect();
    let mut columns: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for record in reader.records() {
        let record = record.unwrap();
        head.iter().zip(&record).for_each(|(k, v)| columns.entry(k.clone()).or_default().push(v.to_string()));
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor as _;
    use serde_json::json;

    fn rows() -> Vec<Row> {
        let row = |trial: u64| Row {
            trial,
            case: "a, \"b\"".into(),
            seed: (1 << 53) - 1 - trial,
            axes: [("k".to_string(), json!([1, trial]))].into(),
            draws: [("x".to_string(), json!(0.1 * trial as f64))].into(),
            metrics: [("line.error_mean_mm".to_string(), 1.0 / (3.0 + trial as f64))].into(),
            ..Row::default()
        };
        let failed = Row { status: Status::Failed, reason: "no, it\ncan't".into(), metrics: BTreeMap::new(), ..row(2) };
        vec![row(0), row(1), failed]
    }

    #[test]
    fn csv_gives_back_every_field() {
        let columns = read_csv(&results_csv(&rows()).unwrap());
        assert_eq!(columns["case"][0], "a, \"b\"");
        assert_eq!(columns["k"], ["[1,0]", "[1,1]", "[1,2]"]);
        assert_eq!(columns["line.error_mean_mm"][1].parse::<f64>().unwrap(), 0.25);
        assert_eq!((columns["reason"][2].as_str(), columns["line.error_mean_mm"][2].as_str()), ("no, it\ncan't", ""));
        assert!(!columns.contains_key("line.coverage"));
    }

    #[test]
    fn parquet_gives_back_the_same_as_csv() {
        let bytes = results_parquet(&rows()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("x.parquet");
        std::fs::write(&file, &bytes).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(file).unwrap()).unwrap();
        let csv = read_csv(&results_csv(&rows()).unwrap());
        let names: Vec<String> =
            reader.metadata().file_metadata().schema_descr().columns().iter().map(|c| c.name().to_string()).collect();
        let read: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(read.len(), 3);
        let at = |name: &str| names.iter().position(|n| n == name).unwrap();
        assert_eq!(read[1].get_double(at("line.error_mean_mm")).unwrap(), 0.25);
        assert!(read[2].get_double(at("line.error_mean_mm")).is_err(), "null");
        assert_eq!(read[2].get_long(at("seed")).unwrap().to_string(), csv["seed"][2]);
        assert_eq!(read[0].get_string(at("case")).unwrap(), &csv["case"][0]);
        assert_eq!(bytes, results_parquet(&rows()).unwrap(), "the same bytes each time");
    }
}
