//! What a base found out of its places, as a table.
use crate::skill::Aligned;

/// A row for each time that a base looked and felt: mm, mrad, px.
pub fn looks_csv(aligned: &[Aligned]) -> String {
    let mut csv = String::from("place,time_s,when,pictures,points,rms_px,felt,correction_mm,correction_mrad,refused\n");
    for a in aligned {
        csv += &format!(
            "{},{:.3},{},{},{},{:.3},{},{:.4},{:.4},{}\n",
            a.place + 1,
            a.time,
            if a.leaving { "leaving" } else { "arrived" },
            a.pictures,
            a.points,
            a.rms_px,
            a.felt,
            a.correction[0] * 1e3,
            a.correction[1] * 1e3,
            a.refused.as_ref().map_or_else(String::new, ToString::to_string),
        );
    }
    csv
}
