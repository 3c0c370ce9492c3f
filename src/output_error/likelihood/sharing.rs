//! Places of the parameters of several maneuvers that share derivatives: the shared derivatives, then
//! each maneuver's own parameters.

use nalgebra::{DMatrix, DVector};

/// Parameters of several maneuvers, or of one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SharedParameters {
    names: Vec<String>,
    /// Derivatives of each maneuver.
    derivatives: Vec<String>,
    /// Places of the shared derivatives among a maneuver's parameters.
    shared: Vec<usize>,
    /// Place of each parameter of each maneuver.
    members: Vec<Vec<usize>>,
}

impl SharedParameters {
    /// Places the parameters of maneuvers. Each maneuver has a label for its own parameters, the
    /// names of all its parameters, and the number of derivatives, which come first. `is_own`
    /// selects the derivatives that each maneuver keeps to itself.
    ///
    /// # Errors
    /// A sentence that names the maneuver whose free derivatives differ from the first maneuver's.
    pub fn new<'a>(
        members: impl IntoIterator<Item = (&'a str, &'a [String], usize)>,
        is_own: impl Fn(&str) -> bool,
    ) -> Result<Self, String> {
        let mut all = SharedParameters::default();
        for (label, names, derivatives) in members {
            let derivatives = &names[..derivatives];
            if all.members.is_empty() {
                all.set_shared(derivatives, &is_own);
            } else if *derivatives != all.derivatives {
                return Err(format!(
                    "{label} has other free derivatives than the maneuvers it is joined with"
                ));
            }
            let places = all.place_member(label, names);
            all.members.push(places);
        }
        Ok(all)
    }

    /// Parameters of one maneuver, in its order.
    #[must_use]
    pub fn of_one(names: &[String]) -> Self {
        SharedParameters {
            names: names.to_vec(),
            derivatives: names.to_vec(),
            shared: (0..names.len()).collect(),
            members: vec![(0..names.len()).collect()],
        }
    }

    /// Sets the shared derivatives: the first maneuver's, without derivatives that each maneuver
    /// keeps to itself.
    fn set_shared(&mut self, derivatives: &[String], is_own: impl Fn(&str) -> bool) {
        self.derivatives = derivatives.to_vec();
        for (j, name) in derivatives.iter().enumerate() {
            if !is_own(name) {
                self.shared.push(j);
                self.names.push(name.clone());
            }
        }
    }

    /// Places a maneuver's parameters; its own are appended to the joint ones.
    fn place_member(&mut self, label: &str, names: &[String]) -> Vec<usize> {
        let mut places = Vec::with_capacity(names.len());
        for (j, name) in names.iter().enumerate() {
            if let Some(place) = self.shared.iter().position(|&s| s == j) {
                places.push(place);
            } else {
                places.push(self.names.len());
                self.names.push(format!("{name} of {label}"));
            }
        }
        places
    }

    /// Names of the parameters in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Places of the shared derivatives among a maneuver's parameters.
    #[must_use]
    pub fn shared(&self) -> &[usize] {
        &self.shared
    }

    /// Place of each parameter of a maneuver among the joint ones.
    #[must_use]
    pub fn places(&self, member: usize) -> &[usize] {
        self.members.get(member).map_or(&[], |places| places)
    }

    /// Joint parameters, from the shared derivatives and all parameters of each maneuver; only a
    /// maneuver's own parameters are taken from the latter.
    #[must_use]
    pub fn assemble(&self, shared: &[f64], members: &[Vec<f64>]) -> Vec<f64> {
        let mut joint = shared.to_vec();
        for values in members {
            let own = values
                .iter()
                .enumerate()
                .filter(|(j, _)| !self.shared.contains(j));
            joint.extend(own.map(|(_, v)| *v));
        }
        joint
    }
}

/// Values at these places.
#[must_use]
pub fn values_at(places: &[usize], all: &[f64]) -> Vec<f64> {
    places.iter().map(|&place| all[place]).collect()
}

/// Adds a maneuver's vector to the joint one.
pub fn add_vector(places: &[usize], own: &DVector<f64>, sum: &mut DVector<f64>) {
    for (value, &place) in own.iter().zip(places) {
        sum[place] += value;
    }
}

/// Adds a maneuver's matrix to the joint one.
pub fn add_matrix(places: &[usize], own: &DMatrix<f64>, sum: &mut DMatrix<f64>) {
    for (j, &column) in places.iter().enumerate() {
        for (i, &row) in places.iter().enumerate() {
            sum[(row, column)] += own[(i, j)];
        }
    }
}
