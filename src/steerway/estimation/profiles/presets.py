"""Built-in profiles, by name."""

from steerway.estimation.profiles.schema import Profile

BUILT_IN = {
    profile.name: profile
    for profile in (
        # Otter and Mariner: the process noise of S. Fossen and T. I. Fossen (Sensors 21, 2021, 7910, §6–7) as a
        # spectral density, S = h Q_d, scaled to R in metres. The others are rounded fits to recorded logs.
        Profile(
            name="otter",
            description="Otter USV, 2 m, up to 2 m/s",
            speed_noise=1e-2,
            course_rate_noise=1e-2,
            course_rate_decay=0.1,
            position_std=0.5,
        ),
        Profile(
            name="mariner-usv",
            description="Mariner USV, 6 m, up to 12 m/s",
            speed_noise=2e-2,
            course_rate_noise=2e-5,
            course_rate_decay=0.1,
            position_std=0.5,
        ),
        Profile(
            name="small-usv",
            description="small craft of any kind",
            speed_noise=5e-3,
            course_rate_noise=1e-3,
            course_rate_decay=0.2,
            position_std=0.15,
        ),
        Profile(
            name="sailing-yacht",
            description="sailing yacht or motor boat in a seaway",
            speed_noise=2e-2,
            course_rate_noise=2e-2,
            course_rate_decay=2.0,
            position_std=0.05,
            error_std=0.3,
            error_time=10.0,
        ),
        Profile(
            name="swell",
            description="any vessel whose speed and course a swell moves",
            speed_noise=1e-4,
            course_rate_noise=1e-3,
            course_rate_decay=0.5,
            acceleration_std=0.25,
            position_std=0.05,
        ),
        Profile(
            name="ship",
            description="ship of 50 m and more",
            speed_noise=2e-3,
            course_rate_noise=1e-6,
            course_rate_decay=0.05,
            position_std=0.5,
        ),
        Profile(
            name="ais",
            description="vessels as AIS reports them: seconds to minutes apart, times rounded and late",
            speed_noise=5e-3,
            course_rate_noise=1.5e-4,
            course_rate_decay=0.3,
            acceleration_std=0.07,
            acceleration_time=15.0,
            position_std=3.0,
            time_std=1.0,
            sog_std=0.2,
            velocity_std=0.2,
            steerageway=0.5,
        ),
    )
}
