//! Roots of linear equations, their slopes along the derivatives, and the modes that they form.
//!
//! A mode of two roots is described by their sum and product, which stay smooth where the two
//! become real. Modes are distinguished by the magnitude of their roots.

use nalgebra::linalg::Schur;
use nalgebra::{Complex, SMatrix, SVector};

use super::linear::{Matrix, STATES};
use crate::aero::Axis;
use crate::numerics::dual::Dual;

/// Largest number of iterations of the eigenvalue solver.
const MOST_ITERATIONS: usize = 500;

/// Imaginary part over magnitude below which a root is real.
const REAL: f64 = 1e-9;

/// Distance from the root at which inverse iteration begins, relative to the largest entry of the
/// matrix.
const SHIFT: f64 = 1e-10;

type ComplexVector = SVector<Complex<f64>, STATES>;

/// Root with its slopes along the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Root {
    pub value: Complex<f64>,
    pub slopes: Vec<Complex<f64>>,
}

impl Root {
    #[must_use]
    fn is_complex(&self) -> bool {
        self.value.im.abs() > REAL * self.value.norm()
    }

    /// Value of a real root.
    #[must_use]
    pub fn real(&self) -> Dual {
        Dual::new(self.value.re, self.slopes.iter().map(|s| s.re).collect())
    }
}

/// Two roots that form a mode: a complex pair, or two real ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    pub sum: Dual,
    pub product: Dual,
}

impl Pair {
    fn new(first: &Root, second: &Root) -> Pair {
        let both = first.slopes.iter().zip(&second.slopes);
        let product =
            |(a, b): (&Complex<f64>, &Complex<f64>)| (second.value * a + first.value * b).re;
        Pair {
            sum: Dual::new(
                (first.value + second.value).re,
                both.clone().map(|(a, b)| (a + b).re).collect(),
            ),
            product: Dual::new((first.value * second.value).re, both.map(product).collect()),
        }
    }

    /// Undamped natural frequency; NaN if one root diverges.
    #[must_use]
    pub fn frequency(&self) -> Dual {
        self.product.clone().sqrt()
    }

    /// Damping ratio; above one for two real roots.
    #[must_use]
    pub fn damping(&self) -> Dual {
        self.decay() / self.frequency()
    }

    /// Damping ratio times frequency.
    #[must_use]
    pub fn decay(&self) -> Dual {
        self.sum.clone() * -0.5
    }
}

/// Modes of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// By falling magnitude.
    pub roots: Vec<Root>,
    /// Indices of the faster mode's roots: short period, or Dutch roll.
    pub fast: [usize; 2],
    /// Indices of the other two: phugoid, or roll mode and spiral.
    pub slow: [usize; 2],
    /// Code of the way in which the roots form modes; it changes when modes coalesce.
    pub pattern: u8,
}

impl Modes {
    /// Modes of a matrix, with their slopes along parameters; `along` has the slopes of the matrix
    /// along each parameter. `None` if the eigenvalues cannot be computed.
    #[must_use]
    pub fn of_matrix(axis: Axis, matrix: &Matrix, along: &[Matrix]) -> Option<Modes> {
        let roots = roots(matrix, along)?;
        let (fast, slow, pattern) = match axis {
            Axis::Longitudinal => longitudinal(&roots),
            Axis::Lateral => lateral(&roots),
        };
        Some(Modes {
            roots,
            fast,
            slow,
            pattern,
        })
    }

    #[must_use]
    pub fn fast_pair(&self) -> Pair {
        Pair::new(&self.roots[self.fast[0]], &self.roots[self.fast[1]])
    }

    #[must_use]
    pub fn slow_pair(&self) -> Pair {
        Pair::new(&self.roots[self.slow[0]], &self.roots[self.slow[1]])
    }

    /// `true` if the slower two roots are an oscillation.
    #[must_use]
    pub fn is_slow_oscillation(&self) -> bool {
        self.roots[self.slow[0]].is_complex()
    }
}

type Roles = ([usize; 2], [usize; 2], u8);

/// The two largest roots are the short period. A pair between two real roots is the short period unless
/// it is smaller than their geometric mean.
fn longitudinal(roots: &[Root]) -> Roles {
    let is_straddled = roots[1].is_complex() && !roots[0].is_complex();
    if !is_straddled {
        return ([0, 1], [2, 3], 0);
    }
    let outer = roots[0].value.norm() * roots[3].value.norm();
    if roots[1].value.norm_sqr() >= outer {
        ([1, 2], [0, 3], 1)
    } else {
        ([0, 3], [1, 2], 2)
    }
}

/// The fastest oscillation is the Dutch roll; of two real roots the larger is the roll mode. Of
/// four real roots the two in the middle take the place of the Dutch roll.
fn lateral(roots: &[Root]) -> Roles {
    // A root and its conjugate stand together.
    let first = roots.iter().position(Root::is_complex).unwrap_or(1);
    let fast = [first, first + 1];
    let slow = match first {
        0 => [2, 3],
        1 => [0, 3],
        _ => [0, 1],
    };
    let oscillating = roots.iter().filter(|root| root.is_complex()).count();
    (fast, slow, u8::try_from(oscillating).unwrap_or(u8::MAX))
}

/// Roots by falling magnitude.
fn roots(matrix: &Matrix, along: &[Matrix]) -> Option<Vec<Root>> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let schur = Schur::try_new(*matrix, f64::EPSILON, MOST_ITERATIONS)?;
    let mut values: Vec<Complex<f64>> = schur.complex_eigenvalues().iter().copied().collect();
    values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    Some(values.into_iter().map(|v| root(matrix, v, along)).collect())
}

/// Root with its slopes. Without parameters its mode is not computed.
fn root(matrix: &Matrix, value: Complex<f64>, along: &[Matrix]) -> Root {
    let slopes = if along.is_empty() {
        vec![]
    } else {
        let solutions = ModeShape::new(matrix, value).solutions(along);
        solutions.iter().map(|solution| solution[STATES]).collect()
    };
    Root { value, slopes }
}

/// Magnitude of the ratio of the last state to the first in the mode of a root, with its slopes along
/// parameters.
#[must_use]
pub fn magnitude_of_ratio(matrix: &Matrix, root: &Root, along: &[Matrix]) -> Dual {
    let shape = ModeShape::new(matrix, root.value);
    let (first, last) = (shape.vector[0], shape.vector[STATES - 1]);
    let ratio = last / first;
    let magnitude = ratio.norm();
    let slope = |solution: &BorderedVector| {
        let by_parameter = (solution[STATES - 1] - ratio * solution[0]) / first;
        (ratio.conj() * by_parameter).re / magnitude
    };
    let slopes = shape.solutions(along).iter().map(slope).collect();
    Dual::new(magnitude, slopes)
}

/// Vector of the bordered equations: slopes of the eigenvector, then of the root.
type BorderedVector = SVector<Complex<f64>, { STATES + 1 }>;

/// Mode of a root. Let A be the matrix, λ the root, and x its eigenvector of unit length. Their slopes
/// dλ and dx along a parameter solve the bordered equations (A − λ) dx − x dλ = −dA x, xᴴ dx = 0.
struct ModeShape {
    /// Matrix A − λ.
    shifted: SMatrix<Complex<f64>, STATES, STATES>,
    vector: ComplexVector,
}

impl ModeShape {
    fn new(matrix: &Matrix, value: Complex<f64>) -> ModeShape {
        let complex = matrix.map(|v| Complex::new(v, 0.0));
        let shifted = complex - SMatrix::<Complex<f64>, STATES, STATES>::identity() * value;
        ModeShape {
            vector: null_vector(&shifted, SHIFT * matrix.amax()),
            shifted,
        }
    }

    /// Solutions of the bordered equations along parameters; NaN where there is none.
    fn solutions(&self, along: &[Matrix]) -> Vec<BorderedVector> {
        if along.is_empty() {
            return vec![];
        }
        let vector = self.vector;
        let mut bordered = SMatrix::<Complex<f64>, 5, 5>::zeros();
        bordered
            .fixed_view_mut::<4, 4>(0, 0)
            .copy_from(&self.shifted);
        bordered.fixed_view_mut::<4, 1>(0, 4).copy_from(&-vector);
        bordered
            .fixed_view_mut::<1, 4>(4, 0)
            .copy_from(&vector.adjoint());
        let factors = bordered.lu();
        let solution = |slope: &Matrix| {
            let change = slope.map(|v| Complex::new(v, 0.0)) * vector;
            let mut right = BorderedVector::zeros();
            right.fixed_rows_mut::<4>(0).copy_from(&-change);
            let nothing = SVector::from_element(Complex::new(f64::NAN, f64::NAN));
            factors.solve(&right).unwrap_or(nothing)
        };
        along.iter().map(solution).collect()
    }
}

/// Unit vector whose image is zero, by inverse iteration.
fn null_vector(matrix: &SMatrix<Complex<f64>, STATES, STATES>, shift: f64) -> ComplexVector {
    let identity = SMatrix::<Complex<f64>, STATES, STATES>::identity();
    let factors = (matrix + identity * Complex::new(shift, 0.0)).lu();
    let one = Complex::new(1.0, 0.0);
    let mut vector = ComplexVector::from_fn(|i, _| one * (1.0 + 0.1 * i as f64));
    for _ in 0..3 {
        let Some(next) = factors.solve(&vector) else {
            break;
        };
        let norm = next.norm();
        if !(norm.is_finite() && norm > 0.0) {
            break;
        }
        vector = next / Complex::new(norm, 0.0);
    }
    vector
}
