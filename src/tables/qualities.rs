//! Tables of the flying qualities: modes of the airframe, their levels, and the roots of its equations.

use crate::aero::Axis;
use crate::schema::{table, words};

words! {
    /// Configuration of the aircraft.
    pub enum Airframe {
        /// Surfaces fixed.
        Bare = "bare",
        /// Surfaces follow the feedback of `qualities.yaml`.
        Augmented = "augmented",
    }
}

words! {
    /// Flying quality: a quantity of a mode, or of the response to a control.
    pub enum FlyingQuality {
        /// Undamped natural frequency ω of the short period, rad/s.
        ShortPeriodFrequency = "short_period_frequency",
        /// Damping ratio ζ of the short period; above 1 for two real roots.
        ShortPeriodDamping = "short_period_damping",
        /// Undamped natural frequency of the phugoid, rad/s.
        PhugoidFrequency = "phugoid_frequency",
        /// Damping ratio of the phugoid.
        PhugoidDamping = "phugoid_damping",
        /// Time in which the phugoid doubles; empty if it decays.
        PhugoidTimeToDouble = "phugoid_time_to_double",
        /// Larger zero of pitch attitude to the pitch control, 1/T_θ2.
        AttitudeZero = "attitude_zero",
        /// Steady change of load factor per angle of attack by the pitch control at constant speed, n/α.
        LoadFactorPerAlpha = "load_factor_per_alpha",
        /// Control anticipation parameter, ω² of the short period over n/α.
        ControlAnticipation = "control_anticipation",
        /// Undamped natural frequency of the Dutch roll.
        DutchRollFrequency = "dutch_roll_frequency",
        /// Damping ratio of the Dutch roll.
        DutchRollDamping = "dutch_roll_damping",
        /// Decay rate ζω of the Dutch roll.
        DutchRollDecay = "dutch_roll_decay",
        /// Amplitude of bank over sideslip in the Dutch roll, |φ/β|.
        PhiBeta = "phi_beta",
        /// Square of the Dutch roll's frequency times |φ/β|.
        DutchRollBank = "dutch_roll_bank",
        /// Time constant of the roll mode; empty if it diverges.
        RollTimeConstant = "roll_time_constant",
        /// Inverse time constant 1/T of the spiral; negative where it diverges.
        SpiralRate = "spiral_rate",
        /// Time in which the spiral doubles; empty if it decays.
        SpiralTimeToDouble = "spiral_time_to_double",
        /// Decay rate ζω of roll and spiral as one oscillation.
        RollSpiralDecay = "roll_spiral_decay",
    }
}

impl FlyingQuality {
    /// Axis whose equations it belongs to.
    #[must_use]
    pub fn axis(self) -> Axis {
        match self {
            FlyingQuality::ShortPeriodFrequency
            | FlyingQuality::ShortPeriodDamping
            | FlyingQuality::PhugoidFrequency
            | FlyingQuality::PhugoidDamping
            | FlyingQuality::PhugoidTimeToDouble
            | FlyingQuality::AttitudeZero
            | FlyingQuality::LoadFactorPerAlpha
            | FlyingQuality::ControlAnticipation => Axis::Longitudinal,
            FlyingQuality::DutchRollFrequency
            | FlyingQuality::DutchRollDamping
            | FlyingQuality::DutchRollDecay
            | FlyingQuality::PhiBeta
            | FlyingQuality::DutchRollBank
            | FlyingQuality::RollTimeConstant
            | FlyingQuality::SpiralRate
            | FlyingQuality::SpiralTimeToDouble
            | FlyingQuality::RollSpiralDecay => Axis::Lateral,
        }
    }

    /// Unit of its values.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            FlyingQuality::ShortPeriodFrequency
            | FlyingQuality::PhugoidFrequency
            | FlyingQuality::DutchRollFrequency => "rad/s",
            FlyingQuality::ShortPeriodDamping
            | FlyingQuality::PhugoidDamping
            | FlyingQuality::DutchRollDamping
            | FlyingQuality::PhiBeta => "-",
            FlyingQuality::PhugoidTimeToDouble
            | FlyingQuality::RollTimeConstant
            | FlyingQuality::SpiralTimeToDouble => "s",
            FlyingQuality::AttitudeZero
            | FlyingQuality::DutchRollDecay
            | FlyingQuality::SpiralRate
            | FlyingQuality::RollSpiralDecay => "1/s",
            FlyingQuality::LoadFactorPerAlpha => "g/rad",
            FlyingQuality::ControlAnticipation => "1/(g s²)",
            FlyingQuality::DutchRollBank => "rad²/s²",
        }
    }
}

words! {
    /// Source of a standard deviation.
    pub enum DeviationBasis {
        /// Exact slopes along all derivatives, and their posterior covariance.
        Slopes = "slopes",
        /// Draws from the posterior: modes coalesce within its uncertainty, or the quantity is not linear
        /// there, as a quotient whose denominator may be zero.
        Draws = "draws",
    }
}

table! {
    /// Flying qualities of the posterior over angle of attack: the equations that are estimated,
    /// linearised about steady wings-level flight.
    ///
    /// Mass, inertias, dynamic pressure, Mach number and path are those flown at this angle of attack.
    pub struct QualityRow in "qualities" per "airframe, angle of attack and quantity" {
        /// Configuration of the aircraft.
        pub airframe: Airframe,
        /// Set of equations.
        pub axis: Axis,
        /// Quantity of a mode.
        pub quantity: FlyingQuality,
        /// Unit of the quantity.
        pub unit: String,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Mach number.
        pub mach: f64 ["1"],
        /// Dynamic pressure.
        pub qbar_psf: f64 ["lbf/ft²"],
        /// Mass.
        pub mass_slug: f64 ["slug"],
        /// Angle of the path above the horizon.
        pub path_deg: f64 ["deg"],
        /// Value at the mean of the posterior. Empty if undefined: the time to double of a mode
        /// that decays, or the frequency of a pair of roots that diverges.
        pub value: Option<f64>,
        /// Standard deviation; of draws, half the width of their central 68 %.
        pub standard_deviation: Option<f64>,
        /// Lower end of the 95 % interval; empty if the interval is open there, or if over 2.5 % of the
        /// draws have no value.
        pub lower_95: Option<f64>,
        /// Upper end of the 95 % interval; empty as the lower one.
        pub upper_95: Option<f64>,
        /// Source of the standard deviation.
        pub basis: DeviationBasis,
        /// Correlation with the damping ratio of the same mode, of the control anticipation and of the
        /// frequency of the Dutch roll.
        pub damping_correlation: Option<f64> ["1"],
    }
}

words! {
    /// Level of flying qualities.
    pub enum Level {
        /// Clearly adequate for the mission.
        One = "1",
        /// Adequate with more workload, or less effect of the mission.
        Two = "2",
        /// Safe; the mission is not accomplished.
        Three = "3",
        /// None of these.
        Worse = "worse",
    }
}

/// `paragraph` of the worst level of all paragraphs.
pub const ALL_PARAGRAPHS: &str = "all";

table! {
    /// Levels of flying qualities with their probabilities, over the posterior of all derivatives.
    pub struct LevelRow in "levels" per "airframe, angle of attack and paragraph" {
        /// Configuration of the aircraft.
        pub airframe: Airframe,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Paragraph of the specification; `all` for the worst of all paragraphs.
        pub paragraph: String,
        /// Subject of the paragraph.
        pub subject: String,
        /// Level at the mean of the posterior.
        pub level: Level,
        /// Probability of Level 1.
        pub level_1_pct: f64 ["%"],
        /// Probability of Level 2.
        pub level_2_pct: f64 ["%"],
        /// Probability of Level 3.
        pub level_3_pct: f64 ["%"],
        /// Probability of less than Level 3.
        pub worse_pct: f64 ["%"],
    }
}

table! {
    /// Roots of the linear equations at the mean of the posterior.
    pub struct RootRow in "roots" per "airframe, angle of attack and root" {
        /// Configuration of the aircraft.
        pub airframe: Airframe,
        /// Set of equations.
        pub axis: Axis,
        /// Angle of attack.
        pub alpha_deg: f64 ["deg"],
        /// Real part; positive where the motion diverges.
        pub real: f64 ["1/s"],
        /// Imaginary part.
        pub imaginary: f64 ["rad/s"],
    }
}
