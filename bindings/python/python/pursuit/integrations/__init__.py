"""Other people's tools: got10k, vot and trackeval (judges of trackers), supervision and ultralytics (what detectors find)."""
