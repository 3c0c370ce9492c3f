"""Loads an exported section into JSBSim itself and compares what it computes with the exported table.

    python3 tests/load_in_jsbsim.py FOLDER [WING_AREA_FT2 SPAN_FT CHORD_FT]

FOLDER is what `harvest export` wrote. Needs the package jsbsim; says so and ends with 77 where it is missing. Ends with 0
when every derivative, every coefficient and all forces and moments agree to 1e-9 of their size, else with 1.
"""

import csv
import math
import os
import pathlib
import re
import shutil
import sys
import tempfile

try:
    import jsbsim
except ImportError:
    print("jsbsim is not installed: nothing was compared")
    sys.exit(77)

AIRCRAFT = """<?xml version="1.0"?>
<fdm_config name="model" version="2.0" release="BETA">
  <fileheader><author>test</author><description>the section alone</description></fileheader>
  <metrics>
    <wingarea unit="FT2">{area}</wingarea><wingspan unit="FT">{span}</wingspan><chord unit="FT">{chord}</chord>
    <location name="AERORP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </metrics>
  <mass_balance>
    <ixx unit="SLUG*FT2">20000</ixx><iyy unit="SLUG*FT2">150000</iyy><izz unit="SLUG*FT2">170000</izz>
    <emptywt unit="LBS">33000</emptywt>
    <location name="CG" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </mass_balance>
  <ground_reactions/>
  <aerodynamics file="section"/>
</fdm_config>
"""

# alpha, beta deg; p, q, r rad/s; speed ft/s; altitude ft
STATES = [
    (5.0, 0.0, 0.0, 0.0, 0.0, 400.0, 20000.0),
    (12.3, 2.0, 0.3, -0.1, 0.05, 350.0, 25000.0),
    (27.5, -4.0, -0.2, 0.25, 0.1, 310.0, 25000.0),
    (33.3, 6.0, 0.1, 0.1, -0.2, 300.0, 30000.0),
    (47.0, 1.0, 0.0, 0.3, 0.0, 250.0, 15000.0),
    (65.0, -1.0, 0.2, 0.0, 0.1, 250.0, 25000.0),
]


def along(points, x):
    """Linear between points, constant beyond."""
    points = sorted(points)
    if x <= points[0][0]:
        return points[0][1]
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        if x <= x1:
            return y0 + (x - x0) / (x1 - x0) * (y1 - y0)
    return points[-1][1]


def read(rows, alpha, mach):
    by_mach = {}
    for row in rows:
        by_mach.setdefault(row["mach"], []).append((float(row["alpha_deg"]), float(row["value"])))
    if "" in by_mach:
        return along(by_mach[""], alpha)
    return along([(float(m), along(points, alpha)) for m, points in by_mach.items()], mach)


def main(folder, area, span, chord):
    with open(folder / "flight_updated.csv", newline="") as file:
        table = {}
        for row in csv.DictReader(file):
            table.setdefault(row["derivative"], []).append(row)
    section = (folder / "flight_updated_jsbsim.xml").read_text()
    own = sorted(set(re.findall(r'<property value="0">(.*?)</property>', section)))
    root = pathlib.Path(tempfile.mkdtemp())
    home = root / "aircraft" / "model"
    home.mkdir(parents=True)
    (home / "model.xml").write_text(AIRCRAFT.format(area=area, span=span, chord=chord))
    shutil.copy(folder / "flight_updated_jsbsim.xml", home / "section.xml")
    os.environ["JSBSIM_DEBUG"] = "0"
    fdm = jsbsim.FGFDMExec(str(root))
    fdm.set_debug_level(0)
    assert fdm.load_model("model"), "JSBSim does not load the section"
    worst, compared = 0.0, 0

    def compare(what, got, expected, size):
        nonlocal worst, compared
        error = abs(got - expected) / max(size, 1e-12)
        worst, compared = max(worst, error), compared + 1
        assert error < 1e-9, f"{what}: JSBSim {got}, exported {expected}"

    for number, (alpha, beta, p, q, r, speed, altitude) in enumerate(STATES):
        surfaces = {name: 3.0 - 1.1 * i + number for i, name in enumerate(own)}
        for name, value in surfaces.items():
            fdm[name] = value
        for name, value in [("h-sl-ft", altitude), ("vt-fps", speed), ("alpha-deg", alpha), ("beta-deg", beta),
                            ("p-rad_sec", p), ("q-rad_sec", q), ("r-rad_sec", r)]:
            fdm["ic/" + name] = value
        assert fdm.run_ic()
        alpha, beta = fdm["aero/alpha-deg"], fdm["aero/beta-deg"]
        speed, qbar, mach = fdm["velocities/vt-fps"], fdm["aero/qbar-psf"], fdm["velocities/mach"]
        p, q, r = (fdm[f"velocities/{axis}-aero-rad_sec"] for axis in "pqr")
        regressors = {"0": 1.0, "alpha": alpha, "beta": beta, "p": p * span / 2 / speed, "q": q * chord / 2 / speed,
                      "r": r * span / 2 / speed}
        sums, loads, sizes = {}, {}, {}
        for name, rows in table.items():
            coefficient, _, regressor = name.partition("_")
            if f'name="aero/harvest/{name}"' not in section:
                continue  # a combined sum
            value = read(rows, alpha, mach)
            compare(name, fdm["aero/harvest/" + name], value, abs(value))
            term = value * regressors.get(regressor, surfaces.get(f"harvest/{regressor}_deg", 0.0))
            part = loads if rows[0]["unit"].startswith(("lbf", "ftlbf")) else sums
            part[coefficient] = part.get(coefficient, 0.0) + term
            sizes[coefficient] = sizes.get(coefficient, 0.0) + abs(term) * (1.0 if part is sums else 0.0)
        for coefficient, value in sums.items():
            compare(coefficient, fdm["aero/harvest/" + coefficient], value, sizes[coefficient])
        signs = {"CN": ("forces/fbz-aero-lbs", -1, 1), "CA": ("forces/fbx-aero-lbs", -1, 1),
                 "CY": ("forces/fby-aero-lbs", 1, 1), "Cl": ("moments/l-aero-lbsft", 1, span),
                 "Cm": ("moments/m-aero-lbsft", 1, chord), "Cn": ("moments/n-aero-lbsft", 1, span)}
        for coefficient, (name, sign, length) in signs.items():
            expected = sign * (qbar * area * length * sums.get(coefficient, 0.0) + loads.get(coefficient, 0.0))
            size = qbar * area * length * sizes.get(coefficient, 0.0) + abs(loads.get(coefficient, 0.0))
            compare(name, fdm[name], expected, size)
    shutil.rmtree(root)
    print(f"JSBSim {jsbsim.__version__}: {compared} values compared, worst {worst:.1e} of their size")
    assert math.isfinite(worst)


if __name__ == "__main__":
    sizes = [float(word) for word in sys.argv[2:5]] or [400.0, 37.42, 11.52]
    main(pathlib.Path(sys.argv[1]), *sizes)
