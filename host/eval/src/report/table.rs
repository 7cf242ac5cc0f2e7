//! The results of an evaluation as a table.

use super::{Distribution, Report, Row, SettingsReport};
use std::fmt;

/// A column of the table that only some evaluations have.
type Column = (&'static str, fn(&Row) -> Option<f64>);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SettingsReport {
            seed, walk, prior, hints, fingerprint_bits, ngram_length, filters, refinement_steps, ..
        } = &self.settings;
        write!(
            f,
            "seed {seed}, walk {walk}, prior {prior}, hints {hints}, {fingerprint_bits} bits, n = {ngram_length}, {refinement_steps} refinement steps"
        )?;
        for (name, filter) in filters {
            // The parameters by the names they have in JSON.
            let parameters = serde_json::to_value(filter).map_err(|_| fmt::Error)?;
            write!(f, "; {name}:")?;
            for (parameter, value) in parameters.as_object().into_iter().flatten() {
                write!(f, " {parameter} {}", value.as_str().map_or(value.to_string(), str::to_owned))?;
            }
        }
        writeln!(f)?;
        let width = self.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).max("name".len());
        write!(f, "{:<width$} {:<7}{:>6}{:>6}{:>7} {:<12}", "name", "filter", "paths", "T", "exact", "95 %")?;
        let columns: [Column; 2] = [("left", |row| row.limit), ("edges", |row| row.exact_edges)];
        let shown = |column: &&Column| self.rows.iter().any(|row| column.1(row).is_some());
        let columns: Vec<&Column> = columns.iter().filter(shown).collect();
        columns.iter().try_for_each(|(name, _)| write!(f, "{name:>6}"))?;
        writeln!(
            f,
            "{:>6}{:>9}{:>8}{:>10}{:>15}{:>14}{:>10}  vertices: maps",
            "iso", "edge F1", "online", "smoothed", "exact from", "d_H, mm", "ms/place"
        )?;
        for row in &self.rows {
            let [low, high] = row.exact_interval;
            let interval = format!("{low:.3}-{high:.3}");
            write!(f, "{:<width$} {:<7}{:>6}{:>6}", row.name, row.filter, row.paths, row.length)?;
            write!(f, "{:>7.3} {interval:<12}", row.exact)?;
            for (_, share) in &columns {
                let share = share(row).map_or("-".to_owned(), |share| format!("{share:.3}"));
                write!(f, "{share:>6}")?;
            }
            write!(f, "{:>6.3}{:>9.3}", row.isomorphic, row.edge_f1)?;
            write!(f, "{:>8.3}{:>10.3}", row.location_online, row.location_smoothed)?;
            let Distribution { median, p90 } = row.places_until_exact;
            let place = |place: Option<usize>| place.map_or("never".to_owned(), |place| place.to_string());
            write!(f, "{:>15}", format!("{} / {}", place(median), place(p90)))?;
            let Distribution { median, p90 } = row.consistency_mm;
            let distance = |mm: u16| if mm == u16::MAX { "inf".to_owned() } else { mm.to_string() };
            let distances = format!("{} / {}", distance(median), distance(p90));
            write!(f, "{distances:>14}{:>10.3} ", row.seconds_per_place * 1e3)?;
            row.vertices.iter().try_for_each(|(vertices, maps)| write!(f, " {vertices}:{maps}"))?;
            writeln!(f)?;
        }
        self.reliability().try_for_each(|(filter, reliability)| {
            write!(f, "{filter} filter: stated probability of the map, share exact (maps):")?;
            for bin in reliability.bins {
                if let Some((stated, exact)) = bin.shares() {
                    write!(f, "  {stated:.2} {exact:.2} ({})", bin.maps)?;
                }
            }
            writeln!(f, "  mean error {:.3}", reliability.error())
        })
    }
}
