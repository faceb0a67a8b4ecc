//! Stiffness of a solid with pores, from that of the solid between them.
//!
//! The solid is transversely isotropic about axis 1, and the pores are circular cylinders along that
//! axis, so long that their ends do not matter, of any sizes and at random places, filled with a
//! fluid that does not flow from one to the other within a period of the wave. Where such a pore lies in
//! an infinite medium of plane bulk modulus k and transverse and axial shear moduli m and p, Eshelby's
//! tensor is known in closed form, and with it Hill's constraint: the medium opposes a change of the
//! pore's cross section as a lining of the moduli m (in area), k m/(k + 2 m) (in shape) and p (in
//! shear along the axis) would. Each estimate here is the stiffness of matrix and pores under one such
//! constraint. Nothing but +, -, ·, / and the square root is used, so that the bits are the same everywhere.
//! The section "Porosity" of `docs/physics.md` has equations and sources.

use crate::elasticity::{Elasticity, NotElastic};

/// Moduli of a solid that is transversely isotropic about axis 1, Pa. The letters are R. Hill's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HillModuli {
    /// k = (c_2222 + c_2233)/2: stiffness against a change of area across the axis.
    pub plane_bulk: f64,
    /// l = c_1122.
    pub cross: f64,
    /// n = c_1111.
    pub axial: f64,
    /// m = c_2323: stiffness against shear across the axis.
    pub transverse_shear: f64,
    /// p = c_1212 = c_1313: stiffness against shear along the axis.
    pub axial_shear: f64,
}

/// The stiffness with which the material around a pore resists a change of the pore's cross section (Hill's
/// constraint), Pa. Each number adds to the modulus of the same name.
#[derive(Debug, Clone, Copy)]
struct Constraint {
    /// Against a change of its area.
    plane_bulk: f64,
    /// Against a change of its shape.
    transverse_shear: f64,
    /// Against shear along the axis.
    axial_shear: f64,
}

impl HillModuli {
    /// Returns those of a transversely isotropic solid. The entries that follow from others are ignored.
    pub fn from_elasticity(elasticity: &Elasticity) -> Self {
        let c = elasticity.rows();
        Self {
            plane_bulk: 0.5 * (c[1][1] + c[1][2]),
            cross: c[0][1],
            axial: c[0][0],
            transverse_shear: 0.5 * c[3][3],
            axial_shear: 0.5 * c[5][5],
        }
    }

    /// Returns those of a fluid without viscosity; of bulk modulus 0, nothing fills the pores.
    pub const fn of_fluid(bulk_modulus: f64) -> Self {
        Self {
            plane_bulk: bulk_modulus,
            cross: bulk_modulus,
            axial: bulk_modulus,
            transverse_shear: 0.0,
            axial_shear: 0.0,
        }
    }

    /// Returns the elasticity with these moduli.
    ///
    /// # Errors
    /// If one is not finite, or the elasticity not positive definite.
    pub fn elasticity(&self) -> Result<Elasticity, NotElastic> {
        let c22 = self.plane_bulk + self.transverse_shear;
        let c23 = self.plane_bulk - self.transverse_shear;
        let (c44, c55) = (2.0 * self.transverse_shear, 2.0 * self.axial_shear);
        Elasticity::transversely_isotropic([self.axial, self.cross, c22, c23, c44, c55])
    }

    /// Returns the Mori-Tanaka estimate of this solid with pores of a fluid that take the fraction
    /// `porosity` of the volume: the surroundings of the pores are the solid between them.
    #[must_use]
    pub fn mori_tanaka(&self, fluid_bulk_modulus: f64, porosity: f64) -> Self {
        self.with_pores(fluid_bulk_modulus, porosity, Constraint::from_medium(self))
    }

    /// Returns the self-consistent estimate: the surroundings of the pores are the porous solid itself.
    /// `None` where it has no stiffness against shear: from a porosity of 1/2 on, and of 1/3 if nothing
    /// fills the pores.
    pub fn self_consistent(&self, fluid_bulk_modulus: f64, porosity: f64) -> Option<Self> {
        let shear = self.self_consistent_shear(fluid_bulk_modulus, porosity)?;
        let surroundings = Self {
            // It depends on the shear modulus around the pores alone.
            plane_bulk: mixed(self.plane_bulk, fluid_bulk_modulus, porosity, shear),
            transverse_shear: shear,
            axial_shear: self.axial_shear * (1.0 - 2.0 * porosity),
            ..*self
        };
        Some(self.with_pores(fluid_bulk_modulus, porosity, Constraint::from_medium(&surroundings)))
    }

    /// Returns the transverse shear modulus m that the self-consistent estimate has.
    ///
    /// With f the porosity, K the fluid's bulk modulus, and k₁ and m₁ of the solid, it solves
    /// m = m₁ k (1 - 2 f)/(k + 2 f m₁) together with k (K + m - f (K - k₁)) = k₁ (K + m) + f (K - k₁) m:
    /// a quadratic equation, of whose roots not more than one is positive.
    fn self_consistent_shear(&self, fluid_bulk_modulus: f64, porosity: f64) -> Option<f64> {
        let (bulk, shear) = (self.plane_bulk, self.transverse_shear);
        let solid = 1.0 - porosity;
        let intact = 1.0 - 2.0 * porosity;
        // k = (n0 + n1 m)/(d0 + m).
        let n0 = bulk * fluid_bulk_modulus;
        let n1 = solid * bulk + porosity * fluid_bulk_modulus;
        let d0 = solid * fluid_bulk_modulus + porosity * bulk;
        let softened = 2.0 * porosity * shear;
        let a = n1 + softened;
        let b = n0 + softened * d0 - intact * shear * n1;
        let c = -intact * shear * n0;
        let root = (b * b - 4.0 * a * c).sqrt();
        // The form without cancellation.
        let found = if b > 0.0 { -2.0 * c / (b + root) } else { (root - b) / (2.0 * a) };
        (intact > 0.0 && found > 0.0).then_some(found)
    }

    /// Returns the stiffness of this solid with pores, under a constraint. With D = C₂ - C₁ of pores and
    /// solid, and f the porosity, it is
    ///
    /// C = C₁ + f D (I + (1 - f) (C₁ + C*)⁻¹ D)⁻¹,
    ///
    /// where C* is infinite for strain along the axis, which pores and solid share.
    fn with_pores(&self, fluid_bulk_modulus: f64, porosity: f64, around: Constraint) -> Self {
        let pores = Self::of_fluid(fluid_bulk_modulus);
        let (bulk, constraint) = (self.plane_bulk, around.plane_bulk);
        let area = relative_strain(bulk, pores.plane_bulk, porosity, constraint);
        let cross = pores.cross - self.cross;
        let through_area = (1.0 - porosity) * cross * cross / ((bulk + constraint) * area);
        let sheared = |own, constraint| mixed(own, 0.0, porosity, constraint);
        Self {
            plane_bulk: mixed(bulk, pores.plane_bulk, porosity, constraint),
            cross: self.cross + porosity * cross / area,
            axial: self.axial + porosity * (pores.axial - self.axial - through_area),
            transverse_shear: sheared(self.transverse_shear, around.transverse_shear),
            axial_shear: sheared(self.axial_shear, around.axial_shear),
        }
    }
}

/// Returns the modulus of solid and pores together, of which the solid has `own`, the pores `of_pores`, and
/// what surrounds the pores `constraint`.
fn mixed(own: f64, of_pores: f64, porosity: f64, constraint: f64) -> f64 {
    own + porosity * (of_pores - own) / relative_strain(own, of_pores, porosity, constraint)
}

/// Returns the mean strain as a multiple of that of the pores, for moduli as of [`mixed`].
fn relative_strain(own: f64, of_pores: f64, porosity: f64, constraint: f64) -> f64 {
    1.0 + (1.0 - porosity) * (of_pores - own) / (own + constraint)
}

impl Constraint {
    /// Returns that of an infinite medium with these moduli.
    fn from_medium(medium: &HillModuli) -> Self {
        let (bulk, shear) = (medium.plane_bulk, medium.transverse_shear);
        Self {
            plane_bulk: shear,
            transverse_shear: bulk * shear / (bulk + 2.0 * shear),
            axial_shear: medium.axial_shear,
        }
    }
}

#[cfg(test)]
mod tests;
