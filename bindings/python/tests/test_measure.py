"""Measuring from Python: the numbers are those of the command, errors are PursuitErrors."""

import numpy as np
import pytest

import pursuit

HEADER = "frame,time_s,target,state,x,y,w,h,score,pred_x,pred_y,pred_w,pred_h,meas_x,meas_y,meas_w,meas_h,update_ms\n"


@pytest.fixture
def run(tmp_path):
    """A ball that falls with 9.81 m/s² at 400 pixels a metre."""
    noise = np.random.default_rng(5).normal(0, 0.3, (60, 2))
    with open(tmp_path / "trajectory.csv", "w") as file:
        file.write(HEADER)
        for k in range(60):
            t = k / 60
            x, y = 100 + 300 * t + noise[k, 0], 50 + 0.5 * 3924 * t * t / 4 + noise[k, 1]
            box = f"{x:.3f},{y:.3f},20.000,20.000"
            file.write(f"{k},{t:.6f},1,tracking,{box},0.9,,,,,{box},0.1\n")
    return tmp_path


def test_g_comes_out_in_metres(run):
    found = pursuit.measure(run, scale="100,900,500,900=1m", true_fps=60, fits=["parabola"])
    value, error = found.fit("acceleration")
    assert abs(value - 9.81 / 4) < max(4 * error, 0.03)
    assert found["vy_m_per_s"].shape == (60,) and found["how"][3] == "measured"
    assert found.files == [] and not (run / "measure.csv").exists()


def test_a_calibration_is_kept_and_found(run):
    path = run / "calibration.toml"
    pursuit.calibrate(path, scale="100,900,500,900=1m", origin=(110, 60))
    with pytest.raises(pursuit.UsageError, match="overwrite=True"):
        pursuit.calibrate(path, scale="100,900,500,900=2m")
    found = pursuit.measure(run, out=run, formats=["jsonl"])
    assert found.facts["ruler"]["kind"] == "stick" and (run / "measure.jsonl").exists()
    assert abs(found["x_m"][0]) < 0.01


def test_wrong_rulers_are_usage_errors(run):
    for ruler in ({"scale": "5,5,5,5=1m"}, {"scale": "5,5,9,9=1ell"}, {"target_size": "0m"}, {"plane": ["1,1=1,1m"]}):
        with pytest.raises(pursuit.UsageError):
            pursuit.measure(run, **ruler)
    with pytest.raises(pursuit.UsageError, match="run"):
        pursuit.measure(run / "nowhere")
