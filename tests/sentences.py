"""NMEA 0183 sentences with known truth, for tests."""

import datetime

import numpy as np

from tests import messages

KNOT = 1852.0 / 3600.0
START = 1_719_835_200.0  # 2024-07-01 12:00 UTC


def sealed(body: str) -> bytes:
    """`$body*checksum` with its line end."""
    return b"$%s*%s\r\n" % (body.encode(), messages.checksum(body.encode()))


def clock(time: float, decimals: int = 2) -> tuple[str, str]:
    """hhmmss.ss and ddmmyy."""
    moment = datetime.datetime.fromtimestamp(round(time, 3), datetime.UTC)
    seconds = f"{moment.second + moment.microsecond * 1e-6:0{3 + decimals if decimals else 2}.{decimals}f}"
    return f"{moment:%H%M}{seconds}", f"{moment:%d%m%y}"


def degrees(value: float, width: int, letters: str, decimals: int = 5) -> str:
    """ddmm.mmmmm,N of an angle in degrees."""
    scale = 60 * 10**decimals
    whole, rest = divmod(round(abs(value) * scale), scale)
    minutes = f"{rest / 10**decimals:0{3 + decimals}.{decimals}f}"
    return f"{int(whole):0{width}d}{minutes},{letters[int(value < 0)]}"


def place(lat: float, lon: float, decimals: int = 5) -> str:
    """The four fields of a position."""
    return f"{degrees(lat, 2, 'NS', decimals)},{degrees(lon, 3, 'EW', decimals)}"


def rmc(time, lat, lon, sog_kn=5.0, cog="123.4", talker="GP", variation=",", mode="A", status="A") -> bytes:
    hour, date = clock(time)
    return sealed(f"{talker}RMC,{hour},{status},{place(lat, lon)},{sog_kn},{cog},{date},{variation},{mode}")


def gga(time, lat, lon, talker="GP", quality=1) -> bytes:
    return sealed(f"{talker}GGA,{clock(time)[0]},{place(lat, lon)},{quality},10,0.9,1.0,M,47.0,M,,")


def gll(time, lat, lon, talker="GP") -> bytes:
    return sealed(f"{talker}GLL,{place(lat, lon)},{clock(time)[0]},A,A")


def track(n: int, lat=54.0, lon=10.0, start=START, step=1.0):
    """Times and positions (degrees, exact in 1e-5 minutes) of a boat going north-east."""
    k = np.arange(n)
    return start + step * k, lat + k * 3.01e-3 / 60.0, lon + k * 5.03e-3 / 60.0


def sortie(n: int, **at) -> bytes:
    """A 1 Hz log of RMC, GGA, GLL, VTG and a compass."""
    lines = []
    for time, lat, lon in zip(*track(n, **at), strict=True):
        lines += [rmc(time, lat, lon), gga(time, lat, lon), gll(time, lat, lon)]
        lines += [sealed("GPVTG,123.4,T,,M,5.0,N,9.26,K,A"), sealed("HCHDG,120.0,,,2.5,E")]
    return b"".join(lines)


def only(recording):
    """The fixes of the only source of a recording."""
    (fixes,) = recording.sources.values()
    return fixes
