"""Other people's tools: got10k and vot (judges of trackers), supervision and ultralytics (what detectors find)."""
