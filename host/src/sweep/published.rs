//! The original's numbers, for comparison: printed or digitised (to 0.002) from the figures of its
//! evaluation notebooks, KITTI's rule, depth up to 20 m. Other data, another machine and a decade
//! of seconds lie between: shapes can be compared, values cannot.

/// Prune weights, on odometry 09, 1000 frames.
pub const PRUNE: PruneTable = PruneTable {
    weights: [0, 1, 2, 3, 5, 8, 10],
    elas: Pruned {
        accuracy: [0.911, 0.922, 0.929, 0.935, 0.944, 0.949, 0.904],
        completeness: [0.959, 0.924, 0.890, 0.854, 0.783, 0.640, 0.473],
        memory_gib: [3.103, 2.322, 1.932, 1.647, 1.211, 0.775, 0.611],
    },
    dispnet: Pruned {
        accuracy: [0.889, 0.895, 0.902, 0.908, 0.917, 0.920, 0.889],
        completeness: [0.977, 0.953, 0.928, 0.899, 0.837, 0.706, 0.537],
        memory_gib: [3.827, 2.856, 2.380, 2.038, 1.523, 1.087, 0.794],
    },
};

/// By prune weight.
pub struct PruneTable {
    /// The weights.
    pub weights: [u32; 7],
    /// With ELAS.
    pub elas: Pruned,
    /// With DispNet.
    pub dispnet: Pruned,
}

/// By prune weight, with one source of depth.
pub struct Pruned {
    /// Accuracy of the static map.
    pub accuracy: [f64; 7],
    /// Completeness at each weight.
    pub completeness: [f64; 7],
    /// Memory after the last frame, GiB.
    pub memory_gib: [f64; 7],
}

/// Fusing every k-th frame, k from 1 to 12, odometry 09, DispNet: medians of accuracy.
pub const RATE_ACCURACY: [f64; 12] =
    [0.919, 0.916, 0.914, 0.903, 0.905, 0.908, 0.903, 0.899, 0.897, 0.895, 0.892, 0.886];
/// Completeness at each frame rate, relative to the first, which is read off as 1.
pub const RATE_COMPLETENESS: [f64; 12] =
    [1.0, 0.999, 0.997, 0.995, 0.993, 0.988, 0.984, 0.973, 0.960, 0.949, 0.936, 0.919];

/// Image scale in percent, on odometry 06: mean error rates (1 - accuracy) of ELAS' input, fused,
/// of DispNet's input, fused.
pub const SCALE_ERRORS: [(u32, [f64; 4]); 4] = [
    (100, [0.0729, 0.0724, 0.0761, 0.0807]),
    (75, [0.0643, 0.0689, 0.0836, 0.1031]),
    (50, [0.0690, 0.0807, 0.1238, 0.1602]),
    (25, [0.1162, 0.1624, 0.5206, 0.5989]),
];

/// Table I, which is tracking sequence 09: method, ELAS' accuracy and completeness, DispNet's; none
/// where tracking failed.
pub const METHODS: [(&str, Option<[f64; 4]>); 3] = [
    ("InfiniTAM, its own ICP", None),
    ("stereo odometry, not dynamic", Some([0.921, 0.974, 0.875, 0.984])),
    ("dynamic", Some([0.923, 0.961, 0.879, 0.973])),
];

/// Static accuracy on the tracking sequences 00 to 09 with ELAS: input, not dynamic, dynamic.
pub const DYNAMIC_ELAS: [[f64; 3]; 10] = [
    [0.8512, 0.8285, 0.8650],
    [0.9218, 0.9373, 0.9316],
    [0.9677, 0.9790, 0.9797],
    [0.8875, 0.8987, 0.9062],
    [0.9117, 0.9357, 0.9385],
    [0.8990, 0.9102, 0.9163],
    [0.9602, 0.9668, 0.9709],
    [0.9009, 0.9222, 0.9251],
    [0.9267, 0.9282, 0.9311],
    [0.9184, 0.9210, 0.9238],
];

/// Means over odometry 00 to 10: static accuracy and completeness, dynamic accuracy and
/// completeness; of ELAS' input, fused, DispNet's input, fused.
pub const DEPTHS: [(&str, [f64; 4]); 4] = [
    ("ELAS, input", [0.9102, 0.7942, 0.8415, 0.8650]),
    ("ELAS, fused", [0.9157, 0.9378, 0.8158, 0.9470]),
    ("DispNet, input", [0.8947, 0.9899, 0.8621, 0.9890]),
    ("DispNet, fused", [0.8898, 0.9780, 0.8290, 0.9786]),
];

/// Quartiles over frames of the same experiment, static accuracy: lower, median, upper.
pub const DEPTH_QUARTILES: [(&str, [f64; 3]); 4] = [
    ("ELAS, input", [0.878, 0.923, 0.955]),
    ("ELAS, fused", [0.888, 0.931, 0.959]),
    ("DispNet, input", [0.854, 0.914, 0.951]),
    ("DispNet, fused", [0.849, 0.910, 0.949]),
];
