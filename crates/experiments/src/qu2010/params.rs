//! Constants of `qu2010`, §4, and of the comparison around it.

/// The simulation of a walking person.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simulation {
    /// Position at time 0, in the paper's units (§4).
    pub start: [f64; 2],
    /// Velocity at time 0 (§4).
    pub velocity: [f64; 2],
    /// Acceleration (§4).
    pub acceleration: [f64; 2],
    /// Sampling period `T`, s (§4).
    pub step_s: f64,
    /// `q` of `Q = q E₆`, equation (9).
    pub process_variance: f64,
    /// `r` of `R = r E₂`, equation (9).
    pub measurement_variance: f64,
    /// Steps. The paper does not say; its figure shows some tens.
    pub steps: usize,
}

impl Simulation {
    pub const QU2010: Self = Self {
        start: [15.0, 15.0],
        velocity: [1.5, 1.0],
        acceleration: [0.8, -1.0],
        step_s: 1.0,
        process_variance: 0.3,
        measurement_variance: 2.0,
        steps: 50,
    };
}

/// What surrounds the paper's filter.
pub(super) struct Comparison;

impl Comparison {
    /// Steps left out when the filter starts from zero: it has settled by then.
    pub const BURN_IN: usize = 15;
    /// Values of `q` for the sweep; the independent reference has them for process-noise and deterministic truth.
    pub const SWEEP: [(f64, f64, f64); 6] = [
        (0.1, 1.61, 1.31),
        (0.03, 1.34, 1.13),
        (0.01, 1.15, 0.991),
        (0.003, 0.992, 0.866),
        (0.001, 0.874, 0.771),
        (1e-4, 0.685, 0.612),
    ];
    /// `q` of the quiet one of two interacting constant-acceleration models; the other has the paper's.
    pub const QUIET_VARIANCE: f64 = 1e-4;
    /// Chance that a model stays for another step.
    pub const STAY: f64 = 0.95;
    /// Seeds that the plain filter is tuned on, apart from those of the table.
    pub const TUNING_SEEDS: u32 = 100;
}
