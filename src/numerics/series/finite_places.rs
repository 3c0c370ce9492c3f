//! Places of the finite values of a series, word by word: most samples of a slow channel are missing.

use crate::numerics::vectors::simd::vectorised;

/// Values whose finiteness is one word of bits.
const WORD: usize = u64::BITS as usize;

/// Places of the finite values, in order.
pub(crate) fn finite_places(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    let words = values.chunks(WORD).enumerate();
    words.flat_map(|(n, part)| SetBits(finite_bits(part)).map(move |bit| n * WORD + bit))
}

/// Finite values and their places.
pub(crate) fn finite_values(values: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let count = values
        .chunks(WORD)
        .map(|part| finite_bits(part).count_ones() as usize)
        .sum();
    let (mut places, mut finite) = (vec![0; count], vec![0.0; count]);
    let mut end = 0;
    for (n, part) in values.chunks(WORD).enumerate() {
        let start = end;
        let bits = finite_bits(part);
        end += bits.count_ones() as usize;
        let (places, finite) = (&mut places[start..end], &mut finite[start..end]);
        // A word of a channel without gaps is copied whole.
        if finite.len() == part.len() {
            finite.copy_from_slice(part);
            places
                .iter_mut()
                .zip(n * WORD..)
                .for_each(|(place, k)| *place = k);
        } else {
            for ((place, finite), bit) in places.iter_mut().zip(finite).zip(SetBits(bits)) {
                (*place, *finite) = (n * WORD + bit, part[bit]);
            }
        }
    }
    (places, finite)
}

/// Word with the bit of each finite value set.
fn finite_bits(values: &[f64]) -> u64 {
    vectorised(
        #[inline(always)]
        || {
            let bits = values.iter().enumerate();
            bits.fold(0, |word, (k, v)| word | u64::from(v.is_finite()) << k)
        },
    )
}

/// Places of the bits that are set in a word, from the lowest on.
struct SetBits(u64);

impl Iterator for SetBits {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let lowest = self.0.trailing_zeros() as usize;
        let is_set = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        is_set.then_some(lowest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finite_values_are_found_in_and_across_words() {
        for count in [0, 1, 63, 64, 65, 200] {
            for every in [1, 2, 5, 64, 67] {
                let value = |k: usize| match k % every {
                    0 => k as f64,
                    1 => f64::INFINITY,
                    _ => f64::NAN,
                };
                let values: Vec<f64> = (0..count).map(value).collect();
                let expected: Vec<usize> = (0..count).step_by(every).collect();
                let (places, finite) = finite_values(&values);
                assert_eq!(places, expected);
                let expected: Vec<f64> = expected.into_iter().map(|k| k as f64).collect();
                assert_eq!(finite, expected);
            }
        }
    }
}
