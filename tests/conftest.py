"""Settings for all tests: hypothesis draws the same examples in every run."""

from __future__ import annotations

from hypothesis import HealthCheck, Phase, settings

settings.register_profile(
    "weavecore",
    deadline=None,
    derandomize=True,
    database=None,
    max_examples=20,
    phases=[Phase.explicit, Phase.generate],  # Shrinking an example costs many weaves and tells little.
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("weavecore")
