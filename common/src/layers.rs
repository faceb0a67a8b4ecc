//! The three layers: coupling fluid, cortical bone, marrow.

/// A fluid layer, unbounded along x1 and x2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fluid {
    /// Thickness, m (h1 of the coupling fluid, h2 of the marrow).
    pub thickness: f64,
    /// Mass density, kg/m³.
    pub density: f64,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
}

/// The stack of layers along x3, from top to bottom.
///
/// The coupling fluid fills 0 < x3 < h1, the bone -h < x3 < 0, the marrow -(h + h2) < x3 < -h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Fluid 1: coupling gel, skin and muscle; source and receivers lie in it.
    pub coupling: Fluid,
    /// Thickness of the cortical bone, m (h).
    pub bone_thickness: f64,
    /// Fluid 2.
    pub marrow: Fluid,
}

impl Default for Layers {
    /// The paper's geometry: 10 mm of fluid, 4 mm of bone, 10 mm of fluid, both fluids water-like.
    fn default() -> Self {
        let water = Fluid { thickness: 10e-3, density: 1000.0, sound_speed: 1500.0 };
        Self { coupling: water, bone_thickness: 4e-3, marrow: water }
    }
}
