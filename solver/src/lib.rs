//! Velocity of the first arriving signal of a fluid / anisotropic solid / fluid plate; pure, without I/O or clock.
