"""Generator of the standard models; see scripts/make_models."""
