//! Vocabulary of recorders: the usual meanings of column names.

use super::words::Spelling;
use crate::flight::signal;

/// Weight of a name that is exactly one of the usual ones.
pub const EXACT: f64 = 1.0;
/// Weight of a name that contains the words of a quantity among others.
const CONTAINED: f64 = 0.6;

/// Names of one signal.
struct Entry {
    signal: &'static str,
    /// Whole names, without signs and units.
    names: &'static [&'static str],
    /// Words that together denote the signal, at any place in a name.
    words: &'static [&'static [&'static str]],
}

/// Words of columns that are not a measurement of the quantity in the rest of the name.
const DERIVED: &[&str] = &[
    "cmd",
    "command",
    "commanded",
    "demand",
    "demanded",
    "ref",
    "reference",
    "target",
    "desired",
    "error",
    "err",
    "std",
    "sigma",
    "valid",
    "status",
    "bias",
    "dot",
    "rate",
    "limit",
    "trim",
    "sp",
    "setpoint",
    "fail",
    "test",
    "calibrated",
    "indicated",
    "cas",
    "ias",
    "kcas",
    "kias",
    "ground",
    "gps",
    "static",
    "radar",
];

/// Pairs of engines, left before right.
pub const SIDES: [(&str, &str); 8] = [
    ("l", "r"),
    ("left", "right"),
    ("lh", "rh"),
    ("1", "2"),
    ("port", "starboard"),
    ("li", "re"),
    ("links", "rechts"),
    ("sx", "dx"),
];

// English, abbreviations of flight data recorders and of MATLAB; German, French, Italian, Spanish; Russian in Latin letters.
#[rustfmt::skip]
const ENTRIES: &[Entry] = &[
    Entry {
        signal: signal::TIME,
        names: &["time", "t", "times", "tsec", "tim", "timestamp", "irig", "irigtime", "clock", "elapsed", "elapsedtime", "simtime",
            "systime", "reltime", "relativetime", "utc", "timesec", "recordtime", "zeit", "temps", "tempo", "tiempo"],
        words: &[&["time"], &["timestamp"], &["clock"], &["zeit"], &["temps"]],
    },
    Entry {
        signal: signal::ALPHA_VANE,
        names: &["alpha", "alfa", "alf", "aoa", "alphavane", "alphav", "aoavane", "aoatrue", "alphatrue", "incidence"],
        words: &[&["angle", "attack"], &["alpha"], &["alfa"], &["aoa"], &["incidence"], &["anstellwinkel"], &["incidenza"],
            &["angulo", "ataque"]],
    },
    Entry {
        signal: signal::BETA_VANE,
        names: &["beta", "aos", "aoss", "betavane", "betav", "sideslip", "sideslipangle", "slip"],
        words: &[&["sideslip"], &["beta"], &["aos"], &["aoss"], &["slip", "angle"], &["schiebewinkel"], &["derapage"], &["dérapage"],
            &["derapata"], &["derrape"]],
    },
    Entry {
        signal: signal::VELOCITY,
        names: &["v", "vt", "vtas", "tas", "ktas", "velocity", "airspeed", "speed", "vtrue", "trueairspeed", "va", "vtot", "vinf",
            "vair", "fluggeschwindigkeit", "fahrt", "vitesse", "velocita", "velocidad", "vist"],
        words: &[&["true", "airspeed"], &["tas"], &["vtas"], &["ktas"], &["velocity"], &["airspeed"], &["fluggeschwindigkeit"],
            &["fluggeschw"], &["vitesse", "air"], &["vitesse", "propre"], &["vitesse", "vraie"], &["velocita", "vera"],
            &["velocidad", "verdadera"]],
    },
    Entry {
        signal: signal::MACH,
        names: &["mach", "machno", "machnumber", "ma", "m", "mn", "machzahl"],
        words: &[&["mach"], &["machzahl"]],
    },
    Entry {
        signal: signal::ALTITUDE,
        names: &["altitude", "alt", "h", "hp", "palt", "height", "hbaro", "hbar", "baroalt", "altbaro", "pressurealtitude", "altmsl",
            "hpress", "hmsl", "zp", "altitud"],
        words: &[&["altitude"], &["alt"], &["height"], &["hoehe"], &["höhe"], &["druckhoehe"], &["druckhöhe"], &["quota"]],
    },
    Entry {
        signal: signal::P,
        names: &["p", "pb", "pbody", "rollrate", "wx", "omegax", "gyrox", "prate", "rolrate", "rolr", "rrate"],
        words: &[&["roll", "rate"], &["omega", "x"], &["gyro", "x"], &["rate", "p"], &["body", "p"], &["rollrate"],
            &["vit", "roulis"], &["vitesse", "roulis"], &["vel", "rollio"], &["velocita", "rollio"], &["vel", "balanceo"]],
    },
    Entry {
        signal: signal::Q,
        names: &["q", "qb", "qbody", "pitchrate", "wy", "omegay", "gyroy", "qrate", "pitrate", "pitr"],
        words: &[&["pitch", "rate"], &["omega", "y"], &["gyro", "y"], &["rate", "q"], &["body", "q"], &["nickrate"],
            &["vit", "tangage"], &["vitesse", "tangage"], &["vel", "beccheggio"], &["velocita", "beccheggio"], &["vel", "cabeceo"]],
    },
    Entry {
        signal: signal::R,
        names: &["r", "rb", "rbody", "yawrate", "wz", "omegaz", "gyroz", "yrate", "yawr"],
        words: &[&["yaw", "rate"], &["omega", "z"], &["gyro", "z"], &["rate", "r"], &["body", "r"], &["gierrate"],
            &["vit", "lacet"], &["vitesse", "lacet"], &["vel", "imbardata"], &["velocita", "imbardata"], &["vel", "guinada"]],
    },
    Entry {
        signal: signal::THETA,
        names: &["theta", "thet", "the", "tht", "pitch", "ptch", "pitchangle", "pitchattitude", "pitchatt", "tang", "tangage"],
        words: &[&["theta"], &["pitch", "angle"], &["pitch", "ang"], &["pitch", "attitude"], &["pitch", "att"], &["euler", "pitch"],
            &["nickwinkel"], &["längsneigung"], &["laengsneigung"], &["assiette"], &["assetto", "beccheggio"], &["tangazh"],
            &["angulo", "cabeceo"]],
    },
    Entry {
        signal: signal::PHI,
        names: &["phi", "roll", "bank", "bankangle", "rollangle", "rollattitude", "rollatt", "roulis"],
        words: &[&["phi"], &["roll", "angle"], &["roll", "ang"], &["roll", "attitude"], &["roll", "att"], &["bank"],
            &["euler", "roll"], &["rollwinkel"], &["hängewinkel"], &["haengewinkel"], &["querneigung"], &["gite"], &["gîte"],
            &["assetto", "rollio"], &["kren"], &["angulo", "balanceo"]],
    },
    Entry {
        signal: signal::PSI,
        names: &["psi", "yaw", "heading", "hdg", "head", "yawangle", "trueheading", "headingtrue", "cap", "kurs", "prua"],
        words: &[&["psi"], &["heading"], &["hdg"], &["yaw", "angle"], &["yaw", "attitude"], &["euler", "yaw"], &["gierwinkel"],
            &["steuerkurs"], &["rumbo"]],
    },
    Entry {
        signal: signal::AN,
        names: &["an", "nz", "az", "anz", "normacc", "normalacc", "accz", "loadfactor", "vertacc", "accelz", "nzcg", "vrtg", "vertg"],
        words: &[&["normal", "acceleration"], &["normal", "accel"], &["normal", "acc"], &["nz"], &["an"], &["az"],
            &["load", "factor"], &["accel", "z"], &["acc", "z"], &["vertical", "acceleration"], &["acceleration", "z"],
            &["lastvielfaches"], &["facteur", "charge"], &["fattore", "carico"], &["factor", "carga"], &["normalbeschl"],
            &["normalbeschleunigung"]],
    },
    Entry {
        signal: signal::AX,
        names: &["ax", "nx", "accx", "longacc", "axialacc", "accelx", "nxcg", "long", "longg"],
        words: &[&["longitudinal", "acceleration"], &["axial", "acceleration"], &["long", "acc"], &["axial", "acc"],
            &["nx"], &["ax"], &["accel", "x"], &["acc", "x"], &["acceleration", "x"], &["longitudinal", "accel"],
            &["long", "accel"], &["longitudinal", "acc"], &["axial", "accel"],
            &["laengsbeschl"], &["laengsbeschleunigung"], &["längsbeschleunigung"]],
    },
    Entry {
        signal: signal::AY,
        names: &["ay", "ny", "accy", "latacc", "accely", "nycg", "latg"],
        words: &[&["lateral", "acceleration"], &["lateral", "accel"], &["lat", "acc"], &["lat", "accel"], &["lateral", "acc"], &["ny"], &["ay"], &["accel", "y"],
            &["acc", "y"], &["side", "acceleration"], &["acceleration", "y"], &["querbeschl"], &["querbeschleunigung"]],
    },
    Entry {
        signal: signal::QBAR,
        names: &["qbar", "dynamicpressure", "dynpress", "dynp", "pdyn", "dynpres", "qdyn", "qinf", "q", "qd"],
        words: &[&["dynamic", "pressure"], &["qbar"], &["pdyn"], &["dyn", "press"], &["staudruck"], &["pression", "dynamique"],
            &["press", "din"], &["pressione", "dinamica"], &["presion", "dinamica"]],
    },
    Entry {
        signal: signal::AIR_TEMPERATURE,
        names: &["oat", "sat", "tstatic", "tair", "tamb", "tinf", "airtemperature", "airtemp", "outsideairtemperature",
            "outsideairtemp", "staticairtemperature", "staticairtemp", "ambienttemperature", "aussentemperatur"],
        words: &[&["oat"], &["static", "temperature"], &["static", "temp"], &["temperature", "statique"]],
    },
    Entry {
        signal: signal::THRUST,
        names: &["thrust", "netthrust", "totalthrust", "fn", "fnet", "thr"],
        words: &[&["thrust"], &["fnet"], &["schub"], &["poussee"], &["poussée"], &["spinta"], &["empuje"]],
    },
    Entry {
        signal: signal::MASS,
        names: &["mass", "grossmass", "aircraftmass", "acmass", "m", "gw", "grossweight", "acweight", "masa"],
        words: &[&["mass"], &["gross", "weight"], &["aircraft", "weight"], &["masse"], &["massa"]],
    },
    Entry {
        signal: signal::X_CG,
        names: &["xcg", "cgx"],
        words: &[&["x", "cg"], &["xcg"], &["schwerpunkt", "x"], &["centrage", "x"]],
    },
    Entry {
        signal: signal::Y_CG,
        names: &["ycg", "cgy"],
        words: &[&["y", "cg"], &["ycg"], &["schwerpunkt", "y"], &["centrage", "y"]],
    },
    Entry {
        signal: signal::Z_CG,
        names: &["zcg", "cgz"],
        words: &[&["z", "cg"], &["zcg"], &["schwerpunkt", "z"], &["centrage", "z"]],
    },
    Entry { signal: signal::IX, names: &["ix", "ixx", "jx", "jxx", "inertiax"], words: &[&["ixx"], &["inertia", "x"]] },
    Entry { signal: signal::IY, names: &["iy", "iyy", "jy", "jyy", "inertiay"], words: &[&["iyy"], &["inertia", "y"]] },
    Entry { signal: signal::IZ, names: &["iz", "izz", "jz", "jzz", "inertiaz"], words: &[&["izz"], &["inertia", "z"]] },
    Entry { signal: signal::IXZ, names: &["ixz", "jxz", "inertiaxz"], words: &[&["ixz"], &["inertia", "xz"]] },
    Entry {
        signal: signal::RPM_LEFT,
        names: &["rpml", "rpmleft", "leftrpm", "rpm1", "n1l", "n2l", "rpmlh", "rpm", "enginerpm", "lrpm"],
        words: &[&["rpm", "l"], &["rpm", "left"], &["rpm", "1"], &["rpm1"], &["rpm", "lh"], &["drehzahl"], &["drehzahl", "li"],
            &["drehzahl", "links"], &["regime", "g"], &["giri", "sx"], &["n2", "l"], &["n2", "1"], &["eng1", "n2"]],
    },
    Entry {
        signal: signal::RPM_RIGHT,
        names: &["rpmr", "rpmright", "rightrpm", "rpm2", "n1r", "n2r", "rpmrh", "rrpm"],
        words: &[&["rpm", "r"], &["rpm", "right"], &["rpm", "2"], &["rpm2"], &["rpm", "rh"], &["drehzahl", "r"],
            &["drehzahl", "re"], &["drehzahl", "rechts"], &["drehzahl", "2"], &["regime", "d"], &["giri", "dx"], &["n2", "r"], &["n2", "2"], &["eng2", "n2"]],
    },
];

/// Signals that a name may mean, each with a weight up to 1.
#[must_use]
pub fn meanings(spelling: &Spelling) -> Vec<(&'static str, f64)> {
    let joined = spelling.joined();
    let is_right = has_side(spelling, |(_, right)| right);
    let meaning = |entry: &Entry| {
        if entry.names.contains(&joined.as_str()) {
            return Some((entry.signal, EXACT));
        }
        if entry.signal == signal::RPM_LEFT && is_right {
            return None;
        }
        let is_contained = |words: &&[&str]| words.iter().all(|word| spelling.has(word));
        let longest = entry
            .words
            .iter()
            .filter(|words| is_contained(words))
            .map(|w| w.len())
            .max()?;
        let derived = spelling.words.iter().filter(|word| {
            let own = entry
                .words
                .iter()
                .any(|words| words.len() == longest && words.contains(&word.as_str()));
            DERIVED.contains(&word.as_str()) && !own
        });
        (derived.count() == 0).then_some((entry.signal, CONTAINED * (1.0 + 0.1 * longest as f64)))
    };
    ENTRIES.iter().filter_map(meaning).collect()
}

/// Kind of an input of the aircraft.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// Pitch surface behind the wing: positive trailing edge down, nose down.
    Elevator,
    /// Roll surface: positive rolls right.
    Aileron,
    /// Yaw surface: positive trailing edge left, nose left.
    Rudder,
    /// Flap, slat, spoiler, canard, vane: the motion does not determine a sign.
    OtherSurface,
    /// Longitudinal stick or column: positive aft, nose up.
    PitchStick,
    /// Lateral stick or wheel: positive right.
    RollStick,
    /// Pedals: positive right, nose right.
    Pedals,
}

impl Input {
    #[must_use]
    pub fn is_surface(self) -> bool {
        matches!(
            self,
            Input::Elevator | Input::Aileron | Input::Rudder | Input::OtherSurface
        )
    }
}

/// An input, its abbreviations, and the words that name it together.
type InputWords = (
    Input,
    &'static [&'static str],
    &'static [&'static [&'static str]],
);

#[rustfmt::skip]
const INPUTS: &[InputWords] = &[
    (Input::PitchStick, &["dep", "ddep", "lonstk", "stklon", "stickpitch", "deltastick", "etapilot", "ccpos", "cchp"],
        &[&["stick", "pitch"], &["stick", "long"], &["stick", "lon"], &["stick", "longitudinal"], &["stick", "fore"],
            &["column"], &["stick", "aft"], &["stick", "y"], &["pilot", "pitch"], &["yoke", "pitch"], &["stk", "pitch"],
            &["stk", "lon"], &["knueppel", "nick"], &["knüppel", "nick"], &["manche", "prof"], &["manche", "tangage"],
            &["barra", "long"], &["cloche", "long"], &["palanca", "cabeceo"]]),
    (Input::RollStick, &["dap", "latstk", "stklat", "sticklat", "wheel", "cwpos"],
        &[&["stick", "lat"], &["stick", "lateral"], &["stick", "roll"], &["wheel"], &["stick", "x"], &["pilot", "roll"],
            &["yoke", "roll"], &["stk", "roll"], &["stk", "lat"], &["knueppel", "roll"], &["knüppel", "roll"], &["manche", "lat"],
            &["manche", "roulis"], &["barra", "lat"], &["cloche", "lat"], &["palanca", "balanceo"]]),
    (Input::Pedals, &["pedal", "pedals", "ped", "dpp", "rped", "rudped", "ruddpedal"],
        &[&["pedal"], &["pedals"], &["pilot", "yaw"], &["pedale"], &["palonnier"], &["pedaliera"], &["pedales"]]),
    // The symmetric part of a pair in pitch and the antisymmetric part of one in roll are the surfaces of the axis.
    (Input::Elevator, &[], &[&["stab", "sym"], &["stab", "symmetric"], &["stabilator", "sym"], &["stabilator", "symmetric"],
        &["elevator", "sym"], &["elevator", "symmetric"], &["elev", "sym"]]),
    (Input::Aileron, &["ailrn"], &[&["ail", "diff"], &["ail", "differential"], &["aileron", "diff"],
        &["aileron", "differential"], &["ailrn"]]),
    (Input::OtherSurface, &["df", "dlef", "dtef", "lef", "tef", "dsp", "dspoil", "dsb", "dc", "dcan", "slat"],
        &[&["flap"], &["flaps"], &["slat"], &["slats"], &["lef"], &["tef"], &["spoiler"], &["speedbrake"], &["canard"], &["vane"],
            &["airbrake"], &["tab"], &["symmetric"], &["sym"], &["simm"], &["differential"], &["diff"], &["leading", "edge"],
            &["trailing", "edge"], &["tv"], &["klappe"], &["landeklappe"], &["vorfluegel"], &["vorflügel"], &["strahlruder"],
            &["volet"], &["volets"], &["becs"], &["tuyere"], &["tuyère"], &["ugello"]]),
    (Input::Elevator, &["de", "ele", "elev", "dele", "delev", "deltae", "eta", "dh", "dstab", "stab", "ds"],
        &[&["elevator"], &["stabilator"], &["stabilizer"], &["horizontal", "tail"], &["delta", "e"], &["elev"], &["htail"],
            &["stab"], &["hoehenruder"], &["höhenruder"], &["profondeur"], &["equilibratore"], &["profundidad"]]),
    (Input::Aileron, &["da", "ail", "ailn", "dail", "deltaa", "xi"],
        &[&["aileron"], &["ailerons"], &["delta", "a"], &["ail"], &["querruder"], &["gauchissement"], &["alettone"],
            &["alettoni"], &["aleron"]]),
    (Input::Rudder, &["dr", "rud", "rudd", "drud", "deltar", "zeta", "direction"],
        &[&["rudder"], &["rudders"], &["delta", "r"], &["rud"], &["seitenruder"], &["gouverne", "direction"], &["timone"],
            &["timon"]]),
];

/// Input that a name means. `column 3` is a place in a table without names, and no control column.
#[must_use]
pub fn input(spelling: &Spelling) -> Option<Input> {
    if let [word, number] = &spelling.words[..]
        && word == "column"
        && number.chars().all(|c| c.is_ascii_digit())
    {
        return None;
    }
    let joined = spelling.joined();
    let is_derived = is_derived(spelling);
    let fits = |(_, names, words): &&(Input, &[&str], &[&[&str]])| {
        let contained = || {
            words
                .iter()
                .any(|words| words.iter().all(|word| spelling.has(word)))
        };
        names.contains(&joined.as_str()) || (!is_derived && contained())
    };
    INPUTS.iter().find(fits).map(|(input, _, _)| *input)
}

/// `true` for a name with a word that no measured quantity has, such as `cmd`.
#[must_use]
pub fn is_derived(spelling: &Spelling) -> bool {
    spelling.words.iter().any(|w| DERIVED.contains(&w.as_str()))
}

/// `true` for a name of one of two surfaces or engines: `aileron_left`.
#[must_use]
pub fn is_one_side(spelling: &Spelling) -> bool {
    spelling.words.len() > 1
        && (has_side(spelling, |(left, _)| left) || has_side(spelling, |(_, right)| right))
}

/// `true` if one of the words of a name is one of the words of a side.
fn has_side(spelling: &Spelling, side: fn((&'static str, &'static str)) -> &'static str) -> bool {
    SIDES.into_iter().any(|pair| spelling.has(side(pair)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(name: &str) -> Option<&'static str> {
        let mut meanings = meanings(&Spelling::of(name));
        meanings.sort_by(|a, b| b.1.total_cmp(&a.1));
        meanings.first().map(|m| m.0)
    }

    #[test]
    fn usual_names_are_known_in_many_spellings() {
        for (name, signal) in [
            ("AOA", signal::ALPHA_VANE),
            ("Angle of Attack [deg]", signal::ALPHA_VANE),
            ("pitchRate", signal::Q),
            ("PITCH_RATE_DPS", signal::Q),
            ("Pitch Attitude (deg)", signal::THETA),
            ("NZ", signal::AN),
            ("VTAS_mps", signal::VELOCITY),
            ("dynamic_pressure_pa", signal::QBAR),
            ("Altitude_m", signal::ALTITUDE),
            ("Ixx", signal::IX),
            ("OAT", signal::AIR_TEMPERATURE),
            ("T_static [K]", signal::AIR_TEMPERATURE),
            ("Time", signal::TIME),
        ] {
            assert_eq!(best(name), Some(signal), "{name}");
        }
    }

    #[test]
    fn commands_and_other_speeds_are_no_measurements() {
        for name in [
            "theta_cmd",
            "pitch_angle_command",
            "airspeed_calibrated",
            "ground_velocity",
            "alpha_dot",
            "KIAS",
            "TAT",
            "total_air_temperature",
        ] {
            assert_eq!(best(name), None, "{name}");
        }
    }

    #[test]
    fn an_engine_of_the_right_side_is_not_that_of_the_left() {
        for (name, signal) in [
            ("Drehzahl_L", signal::RPM_LEFT),
            ("Drehzahl_R", signal::RPM_RIGHT),
            ("Drehzahl_rechts", signal::RPM_RIGHT),
            ("Drehzahl", signal::RPM_LEFT),
        ] {
            let meanings = meanings(&Spelling::of(name));
            let signals: Vec<&str> = meanings.into_iter().map(|m| m.0).collect();
            assert_eq!(signals, [signal], "{name}");
        }
    }

    #[test]
    fn inputs_are_known_by_their_names() {
        for (name, kind) in [
            ("elevator_deg", Some(Input::Elevator)),
            ("de", Some(Input::Elevator)),
            ("Stick Pitch [in]", Some(Input::PitchStick)),
            ("RudderPosition", Some(Input::Rudder)),
            ("pedal", Some(Input::Pedals)),
            ("flap_deg", Some(Input::OtherSurface)),
            ("elevator_cmd", None),
            ("control column", Some(Input::PitchStick)),
            ("column_3", None),
            ("fuel", None),
        ] {
            assert_eq!(input(&Spelling::of(name)), kind, "{name}");
        }
    }
}
