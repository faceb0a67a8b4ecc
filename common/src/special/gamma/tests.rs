use super::*;

/// Shapes from just below 3 to where the limit is reached, dense around each branch.
fn shapes() -> impl Iterator<Item = f64> {
    let dense = (0..=300).map(|k| 2.999 + 0.25 * f64::from(k));
    let sparse = (0..=60).map(|k| libm::pow(10.0, 1.9 + 0.2 * f64::from(k)));
    dense.chain(sparse).chain([15.999_999, 63.999_999, 64.0])
}

/// Probabilities from 2⁻⁵⁴ to 1 - 2⁻⁵³.
fn probabilities() -> impl Iterator<Item = f64> {
    let lower = (1..=108).map(|k| libm::exp2(-0.5 * f64::from(k)));
    let upper = (2..=106).map(|k| 1.0 - libm::exp2(-0.5 * f64::from(k)));
    let centre = (1..40).map(|k| f64::from(k) / 40.0);
    lower.chain(upper).chain(centre).chain([0.5_f64.next_down()])
}

#[test]
fn a_further_step_moves_nothing_but_rounding() {
    for shape in shapes() {
        let gamma = GammaQuantile::new(shape);
        for u in probabilities() {
            let t = gamma.log_quantile(u);
            let (tail, probability) =
                if u < 0.5 { (Tail::Lower, u) } else { (Tail::Upper, 1.0 - u) };
            let step = gamma.halley_step(t, tail, libm::log(probability));
            assert!(step.abs() < 4e-15, "shape {shape}, u {u:e}, t {t}: {step:e}");
        }
    }
}

/// Up to half the accuracy: ½ and its neighbour are solved on different tails.
#[test]
fn quantiles_increase_with_the_probability() {
    for shape in shapes() {
        let gamma = GammaQuantile::new(shape);
        let mut probabilities: Vec<f64> = probabilities().collect();
        probabilities.sort_by(f64::total_cmp);
        for pair in probabilities.windows(2) {
            let [low, high] = [pair[0], pair[1]].map(|u| gamma.relative_quantile(u));
            assert!(low <= high * (1.0 + 2e-15), "shape {shape}, {pair:?}: {low} {high}");
        }
    }
}

#[test]
fn both_tails_make_one() {
    for shape in [3.0, 5.5, 20.0, 63.0, 64.0, 300.0, 1e5, 1e10] {
        let gamma = GammaQuantile::new(shape);
        for score in [-0.6, -0.2, 0.0, 0.1, 0.5] {
            let t = score / shape.sqrt();
            let x = shape * libm::exp(t);
            let [lower, upper] = if shape < UNIFORM_SHAPE {
                [lower_series(shape, x), upper_fraction(shape, x)]
            } else {
                [Tail::Lower, Tail::Upper].map(|tail| gamma.uniform(t, tail))
            };
            let density = libm::exp(gamma.ln_norm - shape * excess(t));
            let sum = density * (lower + upper);
            assert!((sum - 1.0).abs() < 2e-14, "shape {shape}, t {t}: {sum}");
        }
    }
}

#[test]
fn the_uniform_expansion_meets_series_and_fraction() {
    let gamma = GammaQuantile::new(UNIFORM_SHAPE);
    for u in probabilities() {
        let t = gamma.log_quantile(u);
        let x = UNIFORM_SHAPE * libm::exp(t);
        let (direct, tail) = if u < 0.5 {
            (lower_series(UNIFORM_SHAPE, x), Tail::Lower)
        } else {
            (upper_fraction(UNIFORM_SHAPE, x), Tail::Upper)
        };
        let error = gamma.uniform(t, tail) / direct - 1.0;
        assert!(error.abs() < 4e-14, "u {u:e}: {error:e}");
    }
}

/// From (eᵗ - 1) d(eᵗ)/dη = η eᵗ with eᵗ - 1 = η + …, by comparing powers of η.
#[test]
fn the_coefficients_of_f_follow_from_its_equation() {
    let mut m = [0.0; 35];
    m[1] = 1.0;
    for n in 2..35 {
        let sum: f64 = (2..n).map(|j| j as f64 * m[j] * m[n + 1 - j]).sum();
        m[n] = (m[n - 1] - sum) / (n as f64 + 1.0);
    }
    let mut f = [1.0; 33];
    for n in 1..33 {
        f[n] = -(0..n).map(|k| f[k] * m[n + 1 - k]).sum::<f64>();
        // Relative to the coefficients' decay; the recurrence loses some digits of its own.
        let scale = libm::pow(3.54, -(n as f64));
        assert!((f[n] - F[n]).abs() < 1e-13 * scale, "n {n}: {:e} {:e}", f[n], F[n]);
    }
}

#[test]
fn the_scaled_gamma_function_is_right() {
    // Γ(n) = (n-1)! against its scaled form.
    let mut factorial = 2.0;
    for n in 3..15 {
        let a = f64::from(n);
        let stirling = (a - 0.5) * libm::log(a) - a + HALF_LN_TWO_PI;
        let expected = libm::log(factorial) - stirling;
        assert!((ln_scaled_gamma(a) - expected).abs() < 8e-15, "shape {a}");
        factorial *= a;
    }
    // Temme's recurrence gives the same function as Γ* = 1 + β₁/a.
    for a in [64.0, 100.5, 1e4, 1e9] {
        let expected = libm::log1p(uniform_coefficients(a)[1] / a);
        assert!((ln_scaled_gamma(a) - expected).abs() < 1e-17 + 1e-13 / a, "shape {a}");
    }
}

#[test]
fn an_unbounded_shape_has_its_mean_as_every_quantile() {
    for shape in [1e40, 1e300, f64::MAX, f64::INFINITY] {
        for u in probabilities() {
            assert_eq!(GammaQuantile::new(shape).relative_quantile(u), 1.0, "shape {shape}");
        }
    }
}

#[test]
fn outside_its_domain_there_is_no_quantile() {
    for (shape, u) in [
        (3.0, 0.0),
        (3.0, 1.0),
        (100.0, 0.0),
        (100.0, 1.0),
        (3.0, -0.5),
        (3.0, 1.5),
        (3.0, f64::NAN),
        (0.0, 0.5),
        (-1.0, 0.5),
        (f64::NAN, 0.5),
    ] {
        let x = GammaQuantile::new(shape).quantile(u);
        assert!(x.is_nan(), "shape {shape}, u {u}: {x}");
    }
}
