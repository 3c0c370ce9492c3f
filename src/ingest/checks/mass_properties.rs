//! Checks of signals that no kinematic relation contains: positive sizes, inertias that a body can
//! have, and a mass that the aircraft's lift can carry.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::block_means::BlockMeans;
use crate::aircraft::Aircraft;
use crate::flight::signal;
use crate::ingest::settings::Checks;
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::statistics::order_statistics::upper_median;
use crate::units::{G0_FT_S2, RAD, Unit};

/// A signal with values that no aircraft has.
#[derive(Clone, Debug, PartialEq)]
pub struct ImpossibleSignal {
    pub signal: &'static str,
    pub reason: String,
}

/// Largest excess of a principal moment of inertia over the sum of the two others, as a share;
/// errors of measured inertias may cause it. For a flat body both are equal.
const INERTIA_TOLERANCE: f64 = 0.05;

/// Radius of gyration in roll over half the span, with margins of two: aircraft have 0.22 to 0.38
/// (Raymer, *Aircraft Design*, table 16.1). Inertias in lb ft² for slug ft² make it 5.7 times as
/// large. kg m² makes it 1.16 times as large, which no check of a record can find.
const GYRATION: std::ops::Range<f64> = 0.1..0.8;

/// Least angle of attack at which the mass is checked, deg: below it the lift at zero angle counts
/// as much.
const LEAST_ALPHA_DEG: f64 = 5.0;

/// Normal force coefficient over sin α, per rad, with margins of 2 to 3. Aircraft have 2 beyond
/// stall to 6, and 10 with flaps in landing (Hoerner, *Fluid-Dynamic Lift*). The mass in kg for
/// slug makes it 14.6 times as large.
const LIFT_PER_SIN_ALPHA: std::ops::Range<f64> = 0.6..24.0;

/// Typical normal force coefficient over sin α, per rad: between 2 beyond stall and 10 with flaps. Only the
/// nearest unit of the mass is chosen by it, and units differ by factors of 2.2 and more.
const TYPICAL_LIFT: f64 = 4.0;

/// Least number of blocks from which the mass is checked: ten seconds of a usual setting.
const FEWEST_BLOCKS: usize = 50;

/// Width of the bins of angle of attack in which lift is averaged, deg: half the usual distance of
/// test points.
const BIN_DEG: f64 = 2.5;

/// Least number of blocks of a bin: two seconds of a usual setting.
const FEWEST_IN_BIN: usize = 10;

/// Normal force coefficient of a flight at an angle of attack, from mass and normal acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiftPoint {
    pub alpha_deg: f64,
    pub mach: f64,
    pub normal_force: f64,
}

/// Normal force coefficients of a flight, medians of bins of angle of attack.
pub fn lift_curve(blocks: &BlockMeans, aircraft: &Aircraft, settings: &Checks) -> Vec<LiftPoint> {
    let mut bins: BTreeMap<usize, Vec<LiftPoint>> = BTreeMap::new();
    let mach = blocks.means_of(signal::MACH);
    for lift in lifts(blocks, aircraft, settings) {
        let point = LiftPoint {
            alpha_deg: lift.alpha_deg,
            mach: mach.mean(lift.block),
            normal_force: lift.per_sin_alpha * (lift.alpha_deg * RAD).sin(),
        };
        bins.entry(whole_steps(lift.alpha_deg, BIN_DEG))
            .or_default()
            .push(point);
    }
    let bins = bins.into_values().filter(|bin| bin.len() >= FEWEST_IN_BIN);
    let median = |bin: &[LiftPoint], of: fn(&LiftPoint) -> f64| upper_median(bin.iter().map(of));
    let point = |bin: Vec<LiftPoint>| {
        Some(LiftPoint {
            alpha_deg: median(&bin, |p| p.alpha_deg)?,
            mach: median(&bin, |p| p.mach)?,
            normal_force: median(&bin, |p| p.normal_force)?,
        })
    };
    bins.filter_map(point).collect()
}

/// Finds sizes that are not positive, and inertias that no body has. A velocity or dynamic pressure
/// of zero is allowed: the aircraft is at rest, or the instrument is dead.
pub fn impossible_signals(blocks: &BlockMeans) -> Vec<ImpossibleSignal> {
    let sizes = signal::POSITIVE.iter();
    let found: Vec<ImpossibleSignal> = sizes
        .filter_map(|name| not_positive(blocks, name))
        .collect();
    if found.is_empty() {
        impossible_inertia(blocks).into_iter().collect()
    } else {
        found
    }
}

/// Dynamic pressure of an aircraft that flies, lbf/ft²: that of 90 ft/s at sea level.
const FLYING_PSF: f64 = 10.0;

/// Density of very cold air at sea level, slug/ft³.
const DENSEST_SLUG_FT3: f64 = 0.003;

/// Finds the velocity of an aircraft at rest beside the dynamic pressure of one that flies: below the least velocity
/// no relation is checked.
pub fn impossible_velocity(blocks: &BlockMeans, settings: &Checks) -> Option<ImpossibleSignal> {
    let (velocity, qbar) = (
        blocks.median(signal::VELOCITY)?,
        blocks.median(signal::QBAR)?,
    );
    let most = 0.5 * DENSEST_SLUG_FT3 * velocity * velocity;
    let is_at_rest = velocity < settings.least_velocity_ft_s;
    (is_at_rest && qbar > most.max(FLYING_PSF)).then(|| ImpossibleSignal {
        signal: signal::VELOCITY,
        reason: format!(
            "its median is {velocity:.4} ft/s, that of the dynamic pressure {qbar:.4} lbf/ft2, which needs more speed: is \
             one of them in another unit?"
        ),
    })
}

fn not_positive(blocks: &BlockMeans, name: &'static str) -> Option<ImpossibleSignal> {
    let may_be_zero = [signal::VELOCITY, signal::QBAR].contains(&name);
    let is_wrong = |median: &f64| *median < 0.0 || *median == 0.0 && !may_be_zero;
    let median = blocks.median(name).filter(is_wrong)?;
    let unit = Unit::of_signal(name).name;
    Some(ImpossibleSignal {
        signal: name,
        reason: format!("its median is {median} {unit}; it must be greater than zero"),
    })
}

/// Principal moments of inertia that are not positive, or of which one exceeds the sum of the others.
fn impossible_inertia(blocks: &BlockMeans) -> Option<ImpossibleSignal> {
    let inertia = [signal::IX, signal::IY, signal::IZ, signal::IXZ];
    let [x, y, z, xz] = inertia.map(|name| blocks.median(name));
    let (x, y, z, xz) = (x?, y?, z?, xz?);
    if xz * xz >= x * z {
        return Some(ImpossibleSignal {
            signal: signal::IXZ,
            reason: format!(
                "no body has Ixz {xz:.4} with Ix {x:.4} and Iz {z:.4} slug ft2: its square exceeds \
                 their product"
            ),
        });
    }
    let radius = (0.5 * (x - z)).hypot(xz);
    let (smaller, larger) = (0.5 * (x + z) - radius, 0.5 * (x + z) + radius);
    let of_plane = if x > z { signal::IX } else { signal::IZ };
    let (largest, others, name) = if y > larger {
        (y, smaller + larger, signal::IY)
    } else {
        (larger, smaller + y, of_plane)
    };
    (largest > (1.0 + INERTIA_TOLERANCE) * others).then(|| ImpossibleSignal {
        signal: name,
        reason: format!(
            "no body has moments of inertia Ix {x:.4}, Iy {y:.4}, Iz {z:.4} slug ft2: the largest \
             principal moment, {largest:.4}, exceeds the sum of the others, {others:.4}; is one in \
             another unit?"
        ),
    })
}

/// Finds a roll inertia for which the mass would lie at the axis, or beyond the wing tips. Inertias
/// that are all in one wrong unit keep their ratios, so only the mass and the span contradict them.
pub fn impossible_gyration(blocks: &BlockMeans, aircraft: &Aircraft) -> Option<ImpossibleSignal> {
    let (inertia, mass) = (blocks.median(signal::IX)?, blocks.median(signal::MASS)?);
    let share = (inertia / mass).sqrt() / (0.5 * aircraft.span_ft);
    (share.is_finite() && !GYRATION.contains(&share)).then(|| ImpossibleSignal {
        signal: signal::IX,
        reason: format!(
            "with it and a mass of {mass:.4} slug the radius of gyration in roll is {share:.3} of half \
             the span; aircraft have 0.2 to 0.4: are the inertias, or the mass, in another unit?"
        ),
    })
}

/// Largest distance of an accelerometer from the centre of gravity along each body axis, in spans,
/// with a margin. A slender aircraft is about two spans long and a fifth of a span high.
const FARTHEST_SPANS: [f64; 3] = [3.0, 1.0, 1.0];

/// Finds a centre of gravity outside the aircraft: inches for feet, or another reference point than the sensors'.
pub fn impossible_centre(blocks: &BlockMeans, aircraft: &Aircraft) -> Option<ImpossibleSignal> {
    let sensor = aircraft.sensors.an;
    let axes = [
        (signal::X_CG, sensor.x_ft),
        (signal::Y_CG, sensor.y_ft),
        (signal::Z_CG, sensor.z_ft),
    ];
    axes.into_iter().zip(FARTHEST_SPANS).find_map(|((name, at_ft), spans)| {
        let centre = blocks.median(name)?;
        let is_outside = (centre - at_ft).abs() > spans * aircraft.span_ft;
        is_outside.then(|| ImpossibleSignal {
            signal: name,
            reason: format!(
                "its median, {centre:.4} ft, is {:.0} ft from the accelerometer of `an`, farther than the aircraft is long: \
                 is it in another unit, or from another point than the sensors?",
                (centre - at_ft).abs()
            ),
        })
    })
}

/// Finds a mass with which the lift would be a multiple of any aircraft's, or a fraction of it.
pub fn impossible_mass(
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    mass_unit: Option<&str>,
    settings: &Checks,
) -> Option<ImpossibleSignal> {
    let lift: Vec<f64> = lifts(blocks, aircraft, settings)
        .map(|lift| lift.per_sin_alpha)
        .collect();
    if lift.len() < FEWEST_BLOCKS {
        return None;
    }
    let median = upper_median(lift).filter(|v| !LIFT_PER_SIN_ALPHA.contains(v))?;
    let unit = mass_unit.and_then(|unit| probable_unit(unit, median));
    let unit = unit.map_or_else(String::new, |unit| format!(": is it in {unit}?"));
    Some(ImpossibleSignal {
        signal: signal::MASS,
        reason: format!(
            "with it, `an` and a wing of {} ft2 the normal force coefficient is {median:.3} sin alpha; \
             aircraft have 2 to 6{unit}",
            aircraft.wing_area_ft2
        ),
    })
}

/// Lift in a block of flight at an angle of attack.
struct BlockLift {
    block: usize,
    alpha_deg: f64,
    /// Normal force coefficient over sin α.
    per_sin_alpha: f64,
}

/// Lift in each block in which the aircraft flies at an angle of attack.
fn lifts(
    blocks: &BlockMeans,
    aircraft: &Aircraft,
    settings: &Checks,
) -> impl Iterator<Item = BlockLift> {
    let signals = [
        signal::ALPHA_VANE,
        signal::QBAR,
        signal::VELOCITY,
        signal::MASS,
        signal::AN,
    ]
    .map(|name| blocks.means_of(name));
    let lift = move |block: usize| {
        let [alpha_deg, qbar, velocity, mass, an] = signals.map(|means| means.mean(block));
        let is_flying = velocity > settings.least_velocity_ft_s && qbar > 0.0;
        let force = mass * an * G0_FT_S2;
        let per_sin_alpha = force / (qbar * aircraft.wing_area_ft2 * (alpha_deg * RAD).sin());
        let is_lifting = (LEAST_ALPHA_DEG..90.0).contains(&alpha_deg);
        (is_flying && is_lifting && per_sin_alpha.is_finite()).then_some(BlockLift {
            block,
            alpha_deg,
            per_sin_alpha,
        })
    };
    (0..blocks.count).filter_map(lift)
}

/// Unit of mass, other than the stated one, in which a record would have the most usual lift.
fn probable_unit(stated: &str, lift: f64) -> Option<&'static str> {
    let stated = Unit::parse(stated).ok()?;
    let strangeness = |unit: &Unit| {
        let factor = unit.factor_to(stated).unwrap_or(f64::NAN);
        (lift * factor / TYPICAL_LIFT).ln().abs()
    };
    let other = stated
        .alike()
        .filter(|unit| unit.name != stated.name && !unit.is_rare);
    other
        .min_by(|a, b| strangeness(a).total_cmp(&strangeness(b)))
        .filter(|unit| strangeness(unit) < (lift / TYPICAL_LIFT).ln().abs())
        .map(|unit| unit.name)
}
