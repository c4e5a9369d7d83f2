//! Single oscillators and neurons; each module states its equations, units and source.
//!
//! Most are vector fields of first order ([`crate::math::first_order::Flow`]) in the model's own units: integrate them with
//! [`crate::math::first_order::rk4`], or make joint angles of them with [`crate::joints::linear`].

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
