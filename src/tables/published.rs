//! Columns of published tables that are read back, from an earlier campaign or another night.

use serde::{Deserialize, Deserializer, Serialize};

use super::comparison::{ComparisonRow, TunnelVerdict};
use super::trends::TrendRow;

/// Reads a number of a published table: an empty field as NaN.
fn empty_as_nan<'de, D: Deserializer<'de>>(field: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(field)?.unwrap_or(f64::NAN))
}

/// The columns of published `trends` by which campaigns and nights are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PublishedTrend {
    pub derivative: String,
    pub unit: String,
    pub group: String,
    pub alpha_deg: f64,
    #[serde(deserialize_with = "empty_as_nan")]
    pub value: f64,
    #[serde(deserialize_with = "empty_as_nan")]
    pub standard_error: f64,
}

impl From<&TrendRow> for PublishedTrend {
    fn from(row: &TrendRow) -> PublishedTrend {
        PublishedTrend {
            derivative: row.derivative.clone(),
            unit: row.unit.clone(),
            group: row.group.clone(),
            alpha_deg: row.alpha_deg,
            value: row.value,
            standard_error: row.standard_error,
        }
    }
}

/// The columns of published `comparison` by which nights are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PublishedVerdict {
    pub derivative: String,
    pub alpha_deg: f64,
    pub verdict: TunnelVerdict,
}

impl From<&ComparisonRow> for PublishedVerdict {
    fn from(row: &ComparisonRow) -> PublishedVerdict {
        PublishedVerdict {
            derivative: row.derivative.clone(),
            alpha_deg: row.alpha_deg,
            verdict: row.tunnel.verdict,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::Table;

    fn assert_columns<T: Table>(row: &impl Serialize) {
        let columns: Vec<String> = T::columns(&[]).into_iter().map(|c| c.name).collect();
        let read = serde_json::to_value(row).unwrap();
        for name in read.as_object().unwrap().keys() {
            assert!(columns.contains(name), "{} has no column {name}", T::NAME);
        }
    }

    #[test]
    fn columns_that_are_read_back_are_published() {
        assert_columns::<TrendRow>(&PublishedTrend {
            derivative: "Cm_q".to_owned(),
            unit: "1/rad".to_owned(),
            group: "all".to_owned(),
            alpha_deg: 10.0,
            value: -5.0,
            standard_error: 0.1,
        });
        assert_columns::<ComparisonRow>(&PublishedVerdict {
            derivative: "Cm_q".to_owned(),
            alpha_deg: 10.0,
            verdict: TunnelVerdict::Agrees,
        });
    }
}
