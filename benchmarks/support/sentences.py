"""A generated NMEA 0183 log."""

from datetime import UTC, datetime, timedelta


def sentences(epochs: int) -> bytes:
    """GGA, RMC and VTG at 10 Hz, from a boat that sails north-east."""
    start = datetime(2024, 5, 1, tzinfo=UTC)
    lines = []
    for k in range(epochs):
        now = start + timedelta(seconds=0.1 * k)
        clock, date = now.strftime("%H%M%S.") + f"{now.microsecond // 10_000:02d}", now.strftime("%d%m%y")
        place = f"59{10.0 + 1e-5 * k:08.5f},N,010{20.0 + 1e-5 * k:08.5f},E"
        lines.append(_framed(f"GPGGA,{clock},{place},1,09,0.9,12.3,M,40.1,M,,"))
        lines.append(_framed(f"GPRMC,{clock},A,{place},005.2,045.0,{date},,,A"))
        lines.append(_framed("GPVTG,045.0,T,,M,005.2,N,009.6,K,A"))
    return "".join(lines).encode()


def _framed(body):
    checksum = 0
    for each in body.encode():
        checksum ^= each
    return f"${body}*{checksum:02X}\r\n"
