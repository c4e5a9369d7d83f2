//! Single oscillators and neurons, each from its paper.

pub mod fitzhugh_nagumo;
pub mod half_centre;
pub mod hopf;
pub mod hu;
pub mod kuo;
pub mod matsuoka;
pub mod morris_lecar;
pub mod rayleigh;
pub mod terman_wang;
pub mod van_der_pol;
