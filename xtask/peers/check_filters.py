#!/usr/bin/env python3
"""An independent Kalman filter (filterpy) agrees with the fixtures that our filters are tested against.

The Rust tests hold our filters to these fixtures; this script holds the fixtures to an implementation that is neither ours nor the
one they were made with. Exits non-zero at the first disagreement beyond 1e-9 of max(1, |value|).
"""
import json
import pathlib
import sys

import numpy as np
from filterpy.kalman import KalmanFilter

FIXTURES = pathlib.Path(__file__).resolve().parents[2] / "crates/estimation/tests/fixtures"


def close(name, step, got, want):
    got, want = np.asarray(got, float).ravel(), np.asarray(want, float).ravel()
    worst = np.max(np.abs(got - want) / np.maximum(1.0, np.abs(want)))
    if not worst <= 1e-9:
        sys.exit(f"{name}, step {step}: differs by {worst:.3g}")


def check(name):
    data = json.loads((FIXTURES / name).read_text())
    n, m = len(data["x0"]), len(data["R"])
    kf = KalmanFilter(dim_x=n, dim_z=m)
    kf.x = np.array(data["x0"], float).reshape(n, 1)
    kf.P, kf.Q, kf.R, kf.H = (np.array(data[k], float) for k in ("P0", "Q", "R", "H"))
    for k, step in enumerate(data["steps"]):
        if "F" in data:
            transition = np.array(data["F"], float)
        else:
            transition = np.eye(n)
            transition[0, 2] = transition[1, 3] = data["dt"][k]
        control = np.array(data["B"]) @ np.array(data["u"][k]) if "B" in data else np.zeros(n)
        kf.predict(F=transition)
        kf.x = kf.x + control.reshape(n, 1)
        close(name, k, kf.x, step["x_prior"])
        close(name, k, kf.P, step["P_prior"])
        if data["z"][k] is not None:
            kf.update(np.array(data["z"][k], float).reshape(m, 1))
            close(name, k, kf.x, step["x_post"])
            close(name, k, kf.P, step["P_post"])
    print(f"{name}: {len(data['steps'])} steps agree with filterpy")


for fixture in ("kf_4state_control.json", "kf_6state_ca_control.json", "kf_ball_seed000.json"):
    check(fixture)
