//! Tunnel databases written in each format, and read.

use std::sync::Arc;

use approx::assert_relative_eq;
use arrow::array::{Float32Array, Float64Array, Int32Array, LargeStringArray, StringArray};

use super::*;
use crate::store::encoding;

fn read(
    name: &str,
    content: &[u8],
    third: Option<&str>,
) -> Result<Vec<(usize, TunnelRow)>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    let wanted = |variable: &str| variable.starts_with("CN");
    rows(&path, third, wanted).map_err(|e| e.to_string().replace(&*path.to_string_lossy(), name))
}

fn csv_error(content: &str) -> String {
    read("tunnel.csv", content.as_bytes(), Some("altitude_ft")).unwrap_err()
}

#[test]
fn a_number_that_is_none_is_named_by_line_and_column() {
    let e =
        csv_error("derivative,alpha_deg,value,unit\nCN_q,5,4.0,per_rad\nCN_q,ten,4.0,per_rad\n");
    assert_eq!(e, "tunnel.csv:3: column `alpha_deg`: invalid float literal");
    let e = csv_error(
        "derivative,alpha_deg,value,unit,altitude_ft\nCN_q,5,4.0,per_rad,\nCN_q,6,4.0,per_rad,high\n",
    );
    assert_eq!(e, "tunnel.csv:3: column `altitude_ft`: `high` is no number");
}

#[test]
fn a_missing_column_is_named() {
    let e = csv_error("derivative,alpha_deg,unit\nCN_q,5,per_rad\n");
    assert!(e.contains(":1: no column `value`"), "{e}");
}

#[test]
fn the_third_variable_is_a_column_of_its_name() {
    let content =
        b"derivative,alpha_deg,mach,value,unit,altitude_ft\nCN_q,5,0.3,4.0,per_rad,20000\n";
    let rows = read("tunnel.csv", content, Some("altitude_ft")).unwrap();
    assert_eq!((rows[0].1.mach, rows[0].1.third), (Some(0.3), Some(20e3)));
    assert_eq!(read("tunnel.csv", content, None).unwrap()[0].1.third, None);
}

#[test]
fn parquet_says_what_csv_says() {
    let columns: [(&str, ArrayRef); 5] = [
        (
            "derivative",
            Arc::new(StringArray::from(vec!["CN_q", "CN_q"])),
        ),
        ("alpha_deg", Arc::new(Int32Array::from(vec![5, 10]))),
        ("mach", Arc::new(Float32Array::from(vec![Some(0.25), None]))),
        (
            "unit",
            Arc::new(LargeStringArray::from(vec!["per_rad", "per_rad"])),
        ),
        ("value", Arc::new(Float64Array::from(vec![0.1, 0.3]))),
    ];
    let parquet = |columns: &[(&'static str, ArrayRef)]| {
        let batch = RecordBatch::try_from_iter(columns.iter().cloned()).unwrap();
        encoding::bytes(&batch, encoding::properties().unwrap().build()).unwrap()
    };
    let csv =
        b"derivative,alpha_deg,mach,value,unit\nCN_q,5,0.25,0.1,per_rad\nCN_q,10,,0.3,per_rad\n";
    let rows =
        |found: Vec<(usize, TunnelRow)>| found.into_iter().map(|(_, row)| row).collect::<Vec<_>>();
    assert_eq!(
        rows(read("t.parquet", &parquet(&columns), None).unwrap()),
        rows(read("t.csv", csv, None).unwrap())
    );
    let e = read("t.parquet", &parquet(&columns[..4]), None).unwrap_err();
    assert_eq!(
        e,
        "t.parquet:1: column `value` has no value here, or is missing"
    );
}

const DAVEML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE DAVEfunc PUBLIC "-//AIAA//DTD for Flight Dynamic Models - Functions 2.0//EN" "DAVEfunc.dtd">
<DAVEfunc xmlns="http://daveml.org/2010/DAVEML">
  <variableDef name="angle of attack" varID="alpha" units="rad"/>
  <variableDef name="Mach number" varID="mach" units="nd"/>
  <variableDef name="slope" varID="CNalpha" units="1/rad"/>
  <variableDef name="other" varID="thrust" units="lbf"/>
  <breakpointDef bpID="A"><bpVals>0, 0.5</bpVals></breakpointDef>
  <breakpointDef bpID="M"><bpVals>0.2 0.4 0.6</bpVals></breakpointDef>
  <griddedTableDef gtID="T">
    <description>a tunnel</description>
    <breakpointRefs><bpRef bpID="M"/><bpRef bpID="A"/></breakpointRefs>
    <uncertainty effect="additive"><normalPDF numSigmas="2"><bounds>0.5</bounds></normalPDF></uncertainty>
    <dataTable>1, 2, <!-- last varies fastest -->
      3, 4, 5, 6</dataTable>
  </griddedTableDef>
  <function name="unwanted"><independentVarPts varID="thrust">1 2</independentVarPts><dependentVarPts varID="thrust">1 2</dependentVarPts></function>
  <function name="f">
    <independentVarRef varID="mach"/><independentVarRef varID="alpha"/>
    <dependentVarRef varID="CNalpha"/>
    <functionDefn><griddedTableRef gtID="T"/></functionDefn>
  </function>
</DAVEfunc>"#;

#[test]
fn daveml_s_last_breakpoint_varies_fastest_and_radians_become_degrees() {
    let rows = read("t.dml", DAVEML.as_bytes(), None).unwrap();
    let half = 0.5_f64.to_degrees();
    let expected = [
        (0.2, 0.0, 1.0),
        (0.2, half, 2.0),
        (0.4, 0.0, 3.0),
        (0.4, half, 4.0),
        (0.6, 0.0, 5.0),
        (0.6, half, 6.0),
    ];
    assert_eq!(rows.len(), expected.len());
    for ((line, row), (mach, alpha_deg, value)) in rows.iter().zip(expected) {
        assert_eq!(
            (*line, row.mach, row.value, row.uncertainty),
            (18, Some(mach), value, Some(0.25))
        );
        assert_relative_eq!(row.alpha_deg, alpha_deg, max_relative = 1e-15);
        assert_eq!(
            (row.unit.as_str(), row.source.as_deref()),
            ("1/rad", Some("a tunnel"))
        );
    }
}

#[test]
fn daveml_s_mistakes_are_named_by_line() {
    let error = |from: &str, to: &str| {
        assert!(DAVEML.contains(from));
        read("t.dml", DAVEML.replace(from, to).as_bytes(), None).unwrap_err()
    };
    assert_eq!(
        error("3, 4, 5, 6", "3, 4, 5"),
        "t.dml:10: 5 values for 6 grid points"
    );
    assert_eq!(
        error("1, 2, <", "1, two, <"),
        "t.dml:14: `two` is no number"
    );
    assert_eq!(
        error("0.2 0.4 0.6", "0.4 0.2 0.6"),
        "t.dml:10: breakpoints must ascend"
    );
    assert_eq!(
        error("bpRef bpID=\"A\"", "bpRef bpID=\"B\""),
        "t.dml:12: there are no breakpoints `B`"
    );
    assert!(
        error(
            "<independentVarRef varID=\"mach\"/>",
            "<independentVarRef varID=\"beta\"/>"
        )
        .starts_with("t.dml:19: a table over `beta`")
    );
    assert!(
        error(
            "<independentVarRef varID=\"mach\"/>",
            "<independentVarRef varID=\"mach\" interpolate=\"cubicSpline\"/>"
        )
        .starts_with("t.dml:19: `interpolate")
    );
    assert!(
        error("effect=\"additive\"", "effect=\"percentage\"")
            .starts_with("t.dml:13: only additive")
    );
    assert!(error("</DAVEfunc>", "").starts_with("t.dml:"));
    assert!(
        error("varID=\"CNalpha\"", "varID=\"lift\"")
            .contains("no function of the file gives a derivative")
    );
}
