//! Elasticity matrices in Kelvin-Mandel form, and the engineering constants of the mean model.
//!
//! The paper's Eq. (6) is the Kelvin-Mandel matrix while its Eq. (9) writes Voigt values on the
//! shear diagonal; here `c_2323 = g_T`, so that `[C]44 = 2 g_T` and `[C]55 = [C]66 = 2 g_L`.

use thiserror::Error;

/// A symmetric positive definite 6×6 elasticity matrix in Kelvin-Mandel form, Pa.
///
/// Index order 11, 22, 33, 23, 31, 12; √2 on the mixed block, 2 on the shear block
/// (the paper's Eq. (6)). Axis 1 is the long axis of the bone, axis 3 its depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity([[f64; 6]; 6]);

/// The five constants of a transversely isotropic solid whose axis of symmetry is axis 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineeringConstants {
    /// e_L, Pa.
    pub longitudinal_young_modulus: f64,
    /// ν_L.
    pub longitudinal_poisson_ratio: f64,
    /// g_L, Pa.
    pub longitudinal_shear_modulus: f64,
    /// e_T, Pa.
    pub transverse_young_modulus: f64,
    /// ν_T.
    pub transverse_poisson_ratio: f64,
}

/// Reason why a 6×6 matrix is not an elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NotElastic {
    /// An entry is NaN or infinite.
    #[error("entry ({row},{column}) is {value}; every entry must be a finite number (Pa)")]
    NotFinite {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The value found.
        value: f64,
    },
    /// Two mirrored entries differ.
    #[error(
        "entry ({row},{column}) is {upper} but ({column},{row}) is {lower}; the matrix must be symmetric"
    )]
    NotSymmetric {
        /// Row of the upper entry, from 1.
        row: usize,
        /// Column of the upper entry, from 1.
        column: usize,
        /// The upper entry, Pa.
        upper: f64,
        /// The lower entry, Pa.
        lower: f64,
    },
    /// The Cholesky factorization fails.
    #[error(
        "is not positive definite (its leading {order}×{order} block is singular or indefinite)"
    )]
    NotPositiveDefinite {
        /// Order of the first leading block that is not positive definite, 1 to 6.
        order: usize,
    },
}

/// A condition of admissibility that a mean model violates.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Inadmissible {
    /// A modulus or the density is not above zero, or not finite.
    #[error("{name} is {value}; it must be above 0")]
    NotPositive {
        /// Name of the constant as in a user's file.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// ν_L is not finite.
    #[error("longitudinal_poisson_ratio is {value}; it must be a finite number")]
    LongitudinalPoissonRatio {
        /// ν_L.
        value: f64,
    },
    /// ν_T is outside (-1, 1).
    #[error("transverse_poisson_ratio is {value}; it must be above -1 and below 1")]
    TransversePoissonRatio {
        /// ν_T.
        value: f64,
    },
    /// e_L (1 - ν_T) - 2 e_T ν_L² is not above zero.
    #[error(
        "e_L (1 - ν_T) - 2 e_T ν_L² is {margin} Pa; it must be above 0 for a positive definite elasticity \
         (longitudinal_young_modulus too small, or a Poisson ratio too large)"
    )]
    NotPositiveDefinite {
        /// The left-hand side, Pa.
        margin: f64,
    },
}

/// Relative asymmetry that a matrix may have, e.g. from printing with few digits.
const ASYMMETRY_MAX: f64 = 1e-9;

impl Elasticity {
    /// Creates the elasticity of a solid that is transversely isotropic about axis 1, from its independent
    /// Kelvin-Mandel entries 11, 12, 22, 23, 44 and 55, Pa; 44 must be 22 less 23.
    ///
    /// # Errors
    /// If an entry is not finite, or if the matrix is not positive definite.
    pub(crate) fn transversely_isotropic(
        [c11, c12, c22, c23, c44, c55]: [f64; 6],
    ) -> Result<Self, NotElastic> {
        Self::new([
            [c11, c12, c12, 0.0, 0.0, 0.0],
            [c12, c22, c23, 0.0, 0.0, 0.0],
            [c12, c23, c22, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, c44, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, c55, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, c55],
        ])
    }

    /// Creates the elasticity with the given Kelvin-Mandel rows, Pa.
    ///
    /// Mirrored entries may differ by 1e-9 of √(C_ii C_jj); then their mean is taken.
    ///
    /// # Errors
    /// If an entry is not finite, or if the matrix is not symmetric or not positive definite.
    pub fn new(mut rows: [[f64; 6]; 6]) -> Result<Self, NotElastic> {
        check_finite(&rows)?;
        for i in 0..6 {
            for j in i + 1..6 {
                let (upper, lower) = (rows[i][j], rows[j][i]);
                let scale = (rows[i][i] * rows[j][j]).abs().sqrt();
                if (upper - lower).abs() > ASYMMETRY_MAX * scale {
                    return Err(NotElastic::NotSymmetric {
                        row: i + 1,
                        column: j + 1,
                        upper,
                        lower,
                    });
                }
                let mean = 0.5 * (upper + lower);
                rows[i][j] = mean;
                rows[j][i] = mean;
            }
        }
        factor(&rows).map_err(|order| NotElastic::NotPositiveDefinite { order })?;
        Ok(Self(rows))
    }

    /// Returns the Kelvin-Mandel rows, Pa; they are symmetric to the bit.
    pub fn rows(&self) -> &[[f64; 6]; 6] {
        &self.0
    }

    /// Returns the upper triangular Cholesky factor `[L]` with `[C] = [L]ᵀ [L]` (the paper's Eq.
    /// (11)), √Pa.
    pub fn cholesky(&self) -> [[f64; 6]; 6] {
        // A value of this type has passed the same factorization in its constructor.
        factor(&self.0).unwrap_or([[f64::NAN; 6]; 6])
    }

    /// Returns component c_ijkl of the tensor, Pa; indices start at 0.
    pub fn component(&self, i: usize, j: usize, k: usize, l: usize) -> f64 {
        const MANDEL: [[usize; 3]; 3] = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];
        let (row, column) = (MANDEL[i][j], MANDEL[k][l]);
        let value = self.0[row][column];
        match (row > 2, column > 2) {
            (false, false) => value,
            (true, true) => 0.5 * value,
            _ => value * std::f64::consts::FRAC_1_SQRT_2,
        }
    }

    /// Returns the engineering constants of the transversely isotropic solid with this matrix's
    /// c_1111, c_1122, c_2222, c_2233 and c_3131: the inverse of
    /// [`EngineeringConstants::elasticity`]. The other entries are ignored.
    pub fn engineering_constants(&self) -> EngineeringConstants {
        let c = &self.0;
        let (c11, c12, c22, c23) = (c[0][0], c[0][1], c[1][1], c[1][2]);
        let bulk = c22 + c23;
        let nu_l = c12 / bulk;
        let e_l = c11 - 2.0 * c12 * nu_l;
        let determinant = c11 * bulk - 2.0 * c12 * c12;
        let shear = c22 - c23;
        // Compliances S22 and S23 of the transverse plane.
        let s22 = (c11 * c22 - c12 * c12) / (shear * determinant);
        let s23 = (c12 * c12 - c11 * c23) / (shear * determinant);
        EngineeringConstants {
            longitudinal_young_modulus: e_l,
            longitudinal_poisson_ratio: nu_l,
            longitudinal_shear_modulus: 0.5 * c[4][4],
            transverse_young_modulus: 1.0 / s22,
            transverse_poisson_ratio: -s23 / s22,
        }
    }
}

impl EngineeringConstants {
    /// Returns the elasticity of the paper's Eqs. (7)-(9), in Kelvin-Mandel form.
    ///
    /// # Errors
    /// The first violated condition of admissibility; [`EngineeringConstants::violated`] returns
    /// all.
    pub fn elasticity(&self) -> Result<Elasticity, Inadmissible> {
        if let Some(&violated) = self.violated().first() {
            return Err(violated);
        }
        let (e_l, nu_l) = (self.longitudinal_young_modulus, self.longitudinal_poisson_ratio);
        let (e_t, nu_t) = (self.transverse_young_modulus, self.transverse_poisson_ratio);
        let margin = self.margin();
        let c11 = e_l * e_l * (1.0 - nu_t) / margin;
        let c12 = e_t * e_l * nu_l / margin;
        let c22 = e_t * (e_l - e_t * nu_l * nu_l) / ((1.0 + nu_t) * margin);
        let c23 = e_t * (e_l * nu_t + e_t * nu_l * nu_l) / ((1.0 + nu_t) * margin);
        // 2 g_T = e_T / (1 + ν_T) is not a free constant.
        let c44 = e_t / (1.0 + nu_t);
        let c55 = 2.0 * self.longitudinal_shear_modulus;
        // In exact arithmetic this always succeeds; rounding can make it fail at the very edge.
        Elasticity::transversely_isotropic([c11, c12, c22, c23, c44, c55])
            .map_err(|_| Inadmissible::NotPositiveDefinite { margin })
    }

    /// Returns every violated condition of admissibility; none for an admissible solid.
    pub fn violated(&self) -> Vec<Inadmissible> {
        let mut violated = Vec::new();
        let moduli = [
            ("longitudinal_young_modulus", self.longitudinal_young_modulus),
            ("longitudinal_shear_modulus", self.longitudinal_shear_modulus),
            ("transverse_young_modulus", self.transverse_young_modulus),
        ];
        for (name, value) in moduli {
            if !(value > 0.0 && value.is_finite()) {
                violated.push(Inadmissible::NotPositive { name, value });
            }
        }
        if !self.longitudinal_poisson_ratio.is_finite() {
            violated.push(Inadmissible::LongitudinalPoissonRatio {
                value: self.longitudinal_poisson_ratio,
            });
        }
        let nu_t = self.transverse_poisson_ratio;
        if !(nu_t > -1.0 && nu_t < 1.0) {
            violated.push(Inadmissible::TransversePoissonRatio { value: nu_t });
        }
        let margin = self.margin();
        if violated.is_empty() && !(margin > 0.0 && margin.is_finite()) {
            violated.push(Inadmissible::NotPositiveDefinite { margin });
        }
        violated
    }

    /// Returns e_L (1 - ν_T) - 2 e_T ν_L², Pa.
    fn margin(&self) -> f64 {
        let nu_l = self.longitudinal_poisson_ratio;
        self.longitudinal_young_modulus * (1.0 - self.transverse_poisson_ratio)
            - 2.0 * self.transverse_young_modulus * nu_l * nu_l
    }
}

fn check_finite(rows: &[[f64; 6]; 6]) -> Result<(), NotElastic> {
    for (i, row) in rows.iter().enumerate() {
        for (j, &value) in row.iter().enumerate() {
            if !value.is_finite() {
                return Err(NotElastic::NotFinite { row: i + 1, column: j + 1, value });
            }
        }
    }
    Ok(())
}

/// Returns the upper triangular `u` with `uᵀ u = c`, or the order of the leading block that is not
/// positive definite.
fn factor(c: &[[f64; 6]; 6]) -> Result<[[f64; 6]; 6], usize> {
    let mut u = [[0.0_f64; 6]; 6];
    for j in 0..6 {
        let mut pivot = c[j][j];
        for row in u.iter().take(j) {
            pivot = (-row[j]).mul_add(row[j], pivot);
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(j + 1);
        }
        u[j][j] = pivot.sqrt();
        for l in j + 1..6 {
            let mut sum = c[j][l];
            for row in u.iter().take(j) {
                sum = (-row[j]).mul_add(row[l], sum);
            }
            u[j][l] = sum / u[j][j];
        }
    }
    Ok(u)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's optimum (Sec. 6).
    const OPTIMUM: EngineeringConstants = EngineeringConstants {
        longitudinal_young_modulus: 17.717e9,
        longitudinal_poisson_ratio: 0.3816,
        longitudinal_shear_modulus: 4.795e9,
        transverse_young_modulus: 9.8254e9,
        transverse_poisson_ratio: 0.4495,
    };

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
    }

    #[test]
    fn the_papers_optimum_has_the_published_stiffnesses() {
        let c = OPTIMUM.elasticity().unwrap();
        // Values from an independent evaluation of Eqs. (7)-(9), in Pa.
        close(c.rows()[0][0], 25_073_336_534.815_72, 1e-14);
        close(c.rows()[0][1], 9_638_805_732.200_893, 1e-14);
        close(c.rows()[2][2], 16_018_700_105.531_574, 1e-14);
        close(c.rows()[1][2], 9_240_224_769.208_706, 1e-14);
        close(c.component(1, 2, 1, 2), 3.389_237_668e9, 1e-9);
        close(c.component(2, 0, 2, 0), 4.795e9, 1e-15);
        close((c.rows()[0][0] / 1598.8).sqrt(), 3960.1, 1e-5);
    }

    #[test]
    fn constants_survive_the_way_there_and_back() {
        let back = OPTIMUM.elasticity().unwrap().engineering_constants();
        close(back.longitudinal_young_modulus, OPTIMUM.longitudinal_young_modulus, 1e-13);
        close(back.longitudinal_poisson_ratio, OPTIMUM.longitudinal_poisson_ratio, 1e-13);
        close(back.longitudinal_shear_modulus, OPTIMUM.longitudinal_shear_modulus, 1e-13);
        close(back.transverse_young_modulus, OPTIMUM.transverse_young_modulus, 1e-13);
        close(back.transverse_poisson_ratio, OPTIMUM.transverse_poisson_ratio, 1e-13);
    }

    #[test]
    fn the_plane_of_symmetry_is_isotropic() {
        let c = OPTIMUM.elasticity().unwrap();
        close(
            c.component(1, 2, 1, 2),
            0.5 * (c.component(1, 1, 1, 1) - c.component(1, 1, 2, 2)),
            1e-14,
        );
    }

    #[test]
    fn cholesky_multiplies_back() {
        let c = OPTIMUM.elasticity().unwrap();
        let l = c.cholesky();
        for i in 0..6 {
            for j in 0..6 {
                let product: f64 = (0..6).map(|m| l[m][i] * l[m][j]).sum();
                assert!((product - c.rows()[i][j]).abs() < 1e-15 * 6.0 * c.rows()[0][0]);
            }
        }
    }

    #[test]
    fn each_violated_condition_is_named() {
        let check = |change: fn(&mut EngineeringConstants), expected: &str| {
            let mut constants = OPTIMUM;
            change(&mut constants);
            let message = constants.elasticity().unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        };
        check(|c| c.longitudinal_young_modulus = 0.0, "longitudinal_young_modulus is 0");
        check(|c| c.longitudinal_shear_modulus = -1.0, "longitudinal_shear_modulus is -1");
        check(|c| c.transverse_young_modulus = f64::NAN, "transverse_young_modulus is NaN");
        check(|c| c.longitudinal_poisson_ratio = f64::NAN, "longitudinal_poisson_ratio is NaN");
        check(|c| c.transverse_poisson_ratio = 1.2, "transverse_poisson_ratio is 1.2");
        check(|c| c.transverse_poisson_ratio = -1.0, "transverse_poisson_ratio is -1");
        check(|c| c.longitudinal_poisson_ratio = 0.9, "e_L (1 - ν_T) - 2 e_T ν_L²");
    }

    #[test]
    fn what_is_no_elasticity_is_refused() {
        let good = *OPTIMUM.elasticity().unwrap().rows();
        let mut rows = good;
        rows[3][1] = 1e9;
        assert!(matches!(
            Elasticity::new(rows),
            Err(NotElastic::NotSymmetric { row: 2, column: 4, .. })
        ));
        let mut rows = good;
        rows[2][2] = 1.0;
        assert_eq!(Elasticity::new(rows), Err(NotElastic::NotPositiveDefinite { order: 3 }));
        let mut rows = good;
        rows[5][5] = f64::NAN;
        assert!(matches!(
            Elasticity::new(rows),
            Err(NotElastic::NotFinite { row: 6, column: 6, .. })
        ));
    }

    #[test]
    fn a_matrix_printed_with_ten_digits_is_symmetric_enough() {
        let mut rows = *OPTIMUM.elasticity().unwrap().rows();
        rows[0][1] += 0.5;
        let c = Elasticity::new(rows).unwrap();
        assert_eq!(c.rows()[0][1].to_bits(), c.rows()[1][0].to_bits());
    }
}
