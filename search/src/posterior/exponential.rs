//! Exponentials of several numbers at once.
//!
//! Drawing a posterior takes some 10⁹ of them, which is most of its time. These are libm's, operation by
//! operation, so that results have the bits that they have by libm itself; without its branches, so that the
//! compiler can use the processor's vectors.

/// How many numbers are computed together.
pub(super) const LANES: usize = 4;

/// So many numbers.
pub(super) type Lanes = [f64; LANES];

/// libm leaves this range to special cases: smaller numbers underflow, larger ones have e^x = 1 + x.
const LEAST: f64 = -700.0;
const LARGEST: f64 = -1e-8;

/// libm's bounds of -x, by the upper half of its bits: ½ ln 2, and 3/2 ln 2.
const HALF: f64 = f64::from_bits(0x3fd6_2e43_0000_0000);
const ONE_AND_HALF: f64 = f64::from_bits(0x3ff0_a2b2_0000_0000);
/// libm's constants: ln 2 in two parts, 1/ln 2, and the polynomial.
const LN2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
const LN2_LOW: f64 = f64::from_bits(0x3dea_39ef_3579_3c76);
const INVERSE_LN2: f64 = f64::from_bits(0x3ff7_1547_652b_82fe);
const P: [f64; 5] = [
    f64::from_bits(0x3fc5_5555_5555_553e),
    f64::from_bits(0xbf66_c16c_16be_bd93),
    f64::from_bits(0x3f11_566a_af25_de2c),
    f64::from_bits(0xbebb_bd41_c5d2_6bf1),
    f64::from_bits(0x3e66_3769_72be_a4d0),
];
/// 2⁵²: the sum of it and of a smaller number is an integer, which its lower bits are.
const INTEGER: f64 = 4_503_599_627_370_496.0;
const EXPONENT_BIAS: u64 = 1023;
const FRACTION_BITS: u32 = 52;

/// Returns e^x for each x up to 0, with the bits of `libm::exp`.
pub(super) fn exp_of_negative(x: Lanes) -> Lanes {
    if x.iter().all(|x| (LEAST..=LARGEST).contains(x)) { x.map(usual) } else { x.map(libm::exp) }
}

/// e^x = 2^-n e^r with r from -½ ln 2 to ½ ln 2.
#[inline]
fn usual(x: f64) -> f64 {
    let rounded = floor(0.5 - INVERSE_LN2 * x);
    let near = if -x >= HALF { 1.0 } else { 0.0 };
    let n = if -x >= ONE_AND_HALF { rounded } else { near };
    let (high, low) = (x + n * LN2_HIGH, -n * LN2_LOW);
    let r = high - low;
    let square = r * r;
    let [p1, p2, p3, p4, p5] = P;
    let c = r - square * (p1 + square * (p2 + square * (p3 + square * (p4 + square * p5))));
    let y = 1.0 + (r * c / (2.0 - c) - low + high);
    // 2^-n: n is the difference of these bits, and far from the bias.
    let bits = (INTEGER + n).to_bits().wrapping_sub(INTEGER.to_bits());
    y * f64::from_bits(EXPONENT_BIAS.wrapping_sub(bits) << FRACTION_BITS)
}

/// Returns the integer part of a number from 0 to some thousands; `f64::floor` may be a call.
#[inline]
fn floor(x: f64) -> f64 {
    let nearest = (x + INTEGER) - INTEGER;
    nearest - if nearest > x { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use osteon_common::ensemble::Germs;

    use super::*;

    /// Over the whole range, and next to where libm changes its ways.
    #[test]
    fn bits_are_those_of_libm() {
        let mut numbers: Vec<f64> = (0..50_000).map(|i| -0.0141 * f64::from(i)).collect();
        for seed in 0..5000 {
            let germs = Germs::draw(9, seed);
            let uniforms = germs.values();
            numbers.extend(uniforms.iter().map(|u| -libm::fabs(*u) * libm::exp(*u)));
        }
        let bounds = [0.0, LEAST, LARGEST, -HALF, -ONE_AND_HALF, -745.2, -708.4, -1e-300];
        let halves = (0..1000).map(|n| -(f64::from(n) + 0.5) * std::f64::consts::LN_2);
        for bound in bounds.into_iter().chain(halves) {
            let near = (0..20).scan(bound, |x, _| Some(std::mem::replace(x, x.next_down())));
            numbers.extend(near.flat_map(|x| [x, 2.0 * bound - x]).map(|x| x.min(0.0)));
        }
        for x in numbers.chunks_exact(LANES) {
            let x: Lanes = std::array::from_fn(|lane| x[lane]);
            let (found, expected) = (exp_of_negative(x), x.map(libm::exp));
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{x:?}");
        }
        // Each number by itself, too: those in a special case take their neighbours with them.
        for &x in &numbers {
            let found = exp_of_negative([x; LANES])[0];
            assert_eq!(found.to_bits(), libm::exp(x).to_bits(), "{x:e}");
        }
        assert!(exp_of_negative([f64::NAN, -1.0, -2.0, -3.0])[0].is_nan());
    }
}
