"""What every test shares."""

from hypothesis import HealthCheck, settings

# Two noisy cores: how long an example takes says nothing about the code.
settings.register_profile(
    "webmap", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("webmap")
