//! Results of the campaign as databases of derivatives.

use crate::aero::WindTunnel;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::tables::{PosteriorRow, TrendRow};

/// Posterior as a database, in the form of a wind tunnel's.
#[must_use]
pub fn of_posterior(rows: &[PosteriorRow], tunnel: &WindTunnel) -> WindTunnel {
    let mut database = WindTunnel::new(tunnel.settings().clone());
    for row in rows {
        let point = TunnelPoint {
            mach: row.mach,
            ..TunnelPoint::new(row.alpha_deg, row.value)
        };
        database.insert_at(&row.derivative, row.third, point);
    }
    database
}

/// Trends as a database: for each derivative its first group in the table, which counts as flight's
/// value.
#[must_use]
pub fn of_trends(rows: &[TrendRow], groups: &[&str], tunnel: &WindTunnel) -> WindTunnel {
    let mut database = WindTunnel::new(tunnel.settings().clone());
    let mut seen: std::collections::BTreeMap<&str, &str> = std::collections::BTreeMap::new();
    for row in rows
        .iter()
        .filter(|row| groups.contains(&row.group.as_str()))
    {
        let first = seen.entry(&row.derivative).or_insert(&row.group);
        if *first == row.group {
            database.insert(&row.derivative, TunnelPoint::new(row.alpha_deg, row.value));
        }
    }
    database
}
