//! The standard normal quantile.

/// Half width of the central interval of u - ½.
const CENTRE: f64 = 0.425;
/// Where √(-ln min(u, 1-u)) passes from the near to the far tail.
const FAR: f64 = 5.0;

/// The standard normal quantile: x with Φ(x) = u, for 0 < u < 1.
///
/// M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution", Applied
/// Statistics 37 (1988), routine PPND16: three rational approximations of about 16 digits. The
/// upper tail is reached through 1 - u, which is exact for u ≥ ½.
///
/// -∞ at 0, +∞ at 1, NaN elsewhere.
pub fn standard_normal_quantile(u: f64) -> f64 {
    let q = u - 0.5;
    if q.abs() <= CENTRE {
        let r = CENTRE * CENTRE - q * q;
        return q * rational(&CENTRAL, r);
    }
    let tail = if q < 0.0 { u } else { 1.0 - u };
    if tail == 0.0 {
        return f64::INFINITY.copysign(q);
    }
    let r = (-libm::log(tail)).sqrt();
    let x = if r <= FAR { rational(&NEAR_TAIL, r - 1.6) } else { rational(&FAR_TAIL, r - FAR) };
    x.copysign(q)
}

/// Numerator and denominator, constant terms first.
type Rational = ([f64; 8], [f64; 8]);

fn rational((numerator, denominator): &Rational, r: f64) -> f64 {
    let horner = |c: &[f64; 8]| c.iter().rev().fold(0.0, |sum, c| sum * r + c);
    horner(numerator) / horner(denominator)
}

const CENTRAL: Rational = (
    [
        3.387_132_872_796_366_5,
        1.331_416_678_917_843_8e2,
        1.971_590_950_306_551_3e3,
        1.373_169_376_550_946e4,
        4.592_195_393_154_987e4,
        6.726_577_092_700_87e4,
        3.343_057_558_358_813e4,
        2.509_080_928_730_122_7e3,
    ],
    [
        1.0,
        4.231_333_070_160_091e1,
        6.871_870_074_920_579e2,
        5.394_196_021_424_751e3,
        2.121_379_430_158_659_7e4,
        3.930_789_580_009_271e4,
        2.872_908_573_572_194_3e4,
        5.226_495_278_852_854e3,
    ],
);

const NEAR_TAIL: Rational = (
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        2.417_807_251_774_506e-1,
        2.272_384_498_926_918_4e-2,
        7.745_450_142_783_414e-4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        6.897_673_349_851e-1,
        1.481_039_764_274_800_8e-1,
        1.519_866_656_361_645_7e-2,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
);

const FAR_TAIL: Rational = (
    [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        2.965_605_718_285_048_7e-1,
        2.653_218_952_657_612_4e-2,
        1.242_660_947_388_078_4e-3,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ],
    [
        1.0,
        5.998_322_065_558_88e-1,
        1.369_298_809_227_358e-1,
        1.487_536_129_085_061_5e-2,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_8e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_939_8e-15,
    ],
);

/// Returns the probability of the standard normal law below `z`.
pub fn normal_probability(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_half_mirrors_the_lower_to_the_bit() {
        for k in 1..2000u32 {
            let u = f64::from(k) / 4096.0;
            let (lower, upper) = (standard_normal_quantile(u), standard_normal_quantile(1.0 - u));
            assert_eq!(lower.to_bits(), (-upper).to_bits(), "u {u}");
        }
    }

    /// Neighbours in u, across both changes of branch: Φ' gives the difference.
    #[test]
    fn branches_meet_within_rounding() {
        for u in [0.075, 0.925, libm::exp(-25.0)] {
            let (low, high) = (u * (1.0 - 1e-9), u * (1.0 + 1e-9));
            let difference = standard_normal_quantile(high) - standard_normal_quantile(low);
            let x = standard_normal_quantile(u);
            let density = libm::exp(-0.5 * x * x) / (2.0 * std::f64::consts::PI).sqrt();
            let jump = difference - (high - low) / density;
            assert!(jump.abs() < 4e-15 * x.abs(), "u {u:e}: {jump:e}");
        }
    }

    #[test]
    fn the_ends_are_infinite_and_the_outside_is_nan() {
        assert_eq!(standard_normal_quantile(0.0), f64::NEG_INFINITY);
        assert_eq!(standard_normal_quantile(1.0), f64::INFINITY);
        for u in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert!(standard_normal_quantile(u).is_nan(), "u {u}");
        }
    }
}
