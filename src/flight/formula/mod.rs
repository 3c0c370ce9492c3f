//! Formula of a channel: arithmetic of recorded columns, with units.
//!
//! `0.5 * P_S / (287.053 [m2/s2/K] * OAT) * TAS^2`: numbers, perhaps with a unit in brackets, columns,
//! `+ - * / ^` and parentheses. Columns are converted to degree, foot, slug, second and kelvin first,
//! so a formula holds in any units. A sum of different quantities is refused.

mod parser;
mod parts;
mod tokens;

use serde::Serialize;

use self::parts::{MOST_OPERANDS, Node};
use crate::flight::linear_table::LinearTable;
use crate::units::{Conversion, Unit, name_of};

pub use self::parts::Operand;

/// Largest number of characters of a formula.
const LONGEST: usize = 500;

/// Formula, checked for units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formula {
    text: String,
    operands: Vec<Operand>,
    #[serde(skip)]
    to_base: Vec<Conversion>,
    #[serde(skip)]
    root: Node,
    /// Conversion of the result to the target's unit.
    #[serde(skip)]
    of_base: Conversion,
    /// Table in which the result is the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<PlacesIn>,
}

/// Table of a formula with the unit of its places.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct PlacesIn {
    unit: String,
    table: LinearTable,
}

impl Formula {
    /// Parses a formula whose result is in the unit `target`. `operand` returns the unit and factor
    /// of a column.
    ///
    /// # Errors
    /// In words: what cannot be read, an unknown column, quantities that do not fit each other.
    pub fn parse(
        text: &str,
        target: Unit,
        operand: impl Fn(&str) -> Result<Operand, String>,
    ) -> Result<Formula, String> {
        if text.chars().count() > LONGEST {
            return Err(format!("a formula has at most {LONGEST} characters"));
        }
        let parsed = parser::parse(text, &operand)?;
        if parsed.dimensions != target.dimensions() {
            return Err(format!(
                "it is in {}, which is no {}",
                name_of(parsed.dimensions),
                target.name
            ));
        }
        if parsed.operands.is_empty() {
            return Err("it contains no column: give the value under `constants`".to_owned());
        }
        Ok(Formula {
            text: text.to_owned(),
            operands: parsed.operands,
            to_base: parsed.to_base,
            root: parsed.root,
            of_base: target.of_base(),
            table: None,
        })
    }

    /// Parses a formula whose result, in the unit `at_unit`, is the place in a table. The result is then
    /// the table's value, in the unit of its values.
    ///
    /// # Errors
    /// As [`Formula::parse`], and for an unknown unit.
    pub fn over(
        text: &str,
        at_unit: &str,
        table: LinearTable,
        operand: impl Fn(&str) -> Result<Operand, String>,
    ) -> Result<Formula, String> {
        let target = Unit::parse(at_unit)?;
        let unit = at_unit.to_owned();
        Ok(Formula {
            table: Some(PlacesIn { unit, table }),
            ..Formula::parse(text, target, operand)?
        })
    }

    /// Range of the places in words, for a value that is held at an end of the table. `None` for a value
    /// between the ends, for a table that is level at that end, and for a formula without a table.
    #[must_use]
    pub fn held_at_end(&self, value: f64) -> Option<String> {
        let PlacesIn { unit, table } = self.table.as_ref()?;
        let [low, high] = table.held_at(value)?;
        Some(format!("`{}` is outside {low} to {high} {unit}", self.text))
    }

    /// Columns of the formula.
    #[must_use]
    pub fn operands(&self) -> &[Operand] {
        &self.operands
    }

    /// Result for one value of each column, in their order.
    #[must_use]
    pub fn value(&self, columns: &[f64]) -> f64 {
        let mut base = [f64::NAN; MOST_OPERANDS];
        let operands = self.operands.iter().zip(&self.to_base);
        for ((in_base, value), (operand, to_base)) in base.iter_mut().zip(columns).zip(operands) {
            *in_base = to_base.of(value * operand.factor);
        }
        let result = self.of_base.of(self.root.value(&base));
        let table = self.table.as_ref();
        table.map_or(result, |places| places.table.value(result))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Columns of an air-data computer, two ailerons and two engines.
    fn operand(column: &str) -> Result<Operand, String> {
        let unit = match column {
            "P_S" => "hPa",
            "OAT" => "degC",
            "TAS" => "m/s",
            "AIL L" | "AIL_R" => "rad",
            "THR1" | "THR2" => "kN",
            "M" => "-",
            "FUEL" => "kg",
            _ => return Err(format!("no column `{column}`")),
        };
        Ok(Operand {
            column: column.to_owned(),
            unit: unit.to_owned(),
            factor: 1.0,
        })
    }

    fn value(text: &str, signal: &str, columns: &[f64]) -> f64 {
        Formula::parse(text, Unit::of_signal(signal), operand)
            .expect(text)
            .value(columns)
    }

    #[test]
    fn formulas_have_the_values_of_hand_calculations() {
        // 1013.25 hPa at 15 degC is 1.225 kg/m3; at 50 m/s 1531.25 Pa, 31.981 psf.
        let pressure = "0.5 * P_S / (287.053 [m2/s2/K] * OAT) * TAS^2";
        let qbar = value(pressure, "qbar_psf", &[1013.25, 15.0, 50.0]);
        assert_relative_eq!(qbar, 31.981, max_relative = 1e-4);
        let compressible = value("0.7 * P_S * M^2", "qbar_psf", &[1013.25, 0.2]);
        assert_relative_eq!(compressible, 59.255, max_relative = 1e-4);
        // Half of 0.1 rad is 2.8648 deg.
        let aileron = value("(`AIL L` - AIL_R) / 2", "da_deg", &[0.07, -0.03]);
        assert_relative_eq!(aileron, 2.864_788_976, max_relative = 1e-9);
        let thrust = value("THR1 + THR2", "thrust_lbf", &[4.448_221_615, 8.896_443_231]);
        assert_relative_eq!(thrust, 3000.0, max_relative = 1e-9);
        let mass = value("1000 [kg] + FUEL", "mass_slug", &[459.390_293_7]);
        assert_relative_eq!(mass, 100.0, max_relative = 1e-9);
        let speed = value(
            "(2 * P_S / (1.225 [kg/m3]))^0.5 * M / M",
            "velocity_ft_s",
            &[6.125, 0.3],
        );
        assert_relative_eq!(speed, 1000_f64.sqrt() / 0.3048, max_relative = 1e-9);
    }

    #[test]
    fn signs_and_powers_bind_as_in_mathematics() {
        for (text, expected) in [
            ("-M^2", -9.0),
            ("2 - M - 1", -2.0),
            ("12 / M / 2", 2.0),
            ("2 * -M", -6.0),
            ("M^-1 * 3", 1.0),
            ("2 + M * 2e0", 8.0),
            ("(2 + M) * 2", 10.0),
        ] {
            assert_relative_eq!(value(text, "mach", &[3.0]), expected, max_relative = 1e-12);
        }
    }

    #[test]
    fn a_recorders_factor_and_a_missing_value_enter() {
        let half = |column: &str| operand(column).map(|o| Operand { factor: -0.5, ..o });
        let formula = Formula::parse("M + 1", Unit::of_signal("mach"), half).unwrap();
        assert_relative_eq!(formula.value(&[0.4]), 0.8);
        assert!(formula.value(&[f64::NAN]).is_nan());
    }

    #[test]
    fn a_table_is_read_at_the_result_in_the_unit_of_its_places() {
        let table = LinearTable::new(vec![0.0, 200.0], vec![1000.0, 1200.0]).unwrap();
        let inertia = Formula::over("FUEL / 2", "kg", table.clone(), operand).unwrap();
        assert_relative_eq!(inertia.value(&[100.0]), 1050.0, max_relative = 1e-9);
        assert_relative_eq!(inertia.value(&[900.0]), 1200.0, max_relative = 1e-9);
        assert!(inertia.value(&[f64::NAN]).is_nan());
        let of_pounds = Formula::over("FUEL", "lb", table.clone(), operand).unwrap();
        // 45.359237 kg are 100 lb.
        assert_relative_eq!(of_pounds.value(&[45.359_237]), 1100.0, max_relative = 1e-6);
        let refused = Formula::over("FUEL", "m", table, operand).unwrap_err();
        assert!(refused.contains("in slug, which is no m"), "{refused}");
    }

    #[test]
    fn what_does_not_fit_is_refused_in_words() {
        let deep = format!("{}M{}", "(".repeat(40), ")".repeat(40));
        for (text, words) in [
            ("THR1 + FUEL", "a sum of lbf and slug"),
            ("THR1 * TAS", "it is in ft2 slug s-3, which is no lbf"),
            ("TRH1", "no column `TRH1`"),
            ("THR1 +", "it ends where a column"),
            ("THR1 THR2", "`THR2` stands where an operator is expected"),
            ("(THR1", "`)` is missing"),
            ("THR1 * 2 [furlong]", "`[furlong]` is no unit"),
            ("THR1 % 2", "`%` has no meaning"),
            ("THR1^0.5", "to the power of 0.5 is no unit"),
            ("M^M", "behind `^` stands a number"),
            ("3 [lbf]", "contains no column"),
            ("1.2.3 * THR1", "`1.2.3` is no number"),
            ("`THR1", "is missing"),
            ("", "it ends where"),
            (deep.as_str(), "nested more than"),
        ] {
            let refused = Formula::parse(text, Unit::of_signal("thrust_lbf"), operand);
            let message = refused.expect_err(text);
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
