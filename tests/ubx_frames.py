"""UBX messages."""

from pyubx2 import GET, UBXMessage


def pvt(second=0, nano=0, lat=-34.9, lon=138.6, **changes):
    fields = {
        "iTOW": 302400000 + second * 1000 + nano // 1000000,
        "year": 2017,
        "month": 7,
        "day": 19,
        "hour": 12,
        "min": 0,
        "second": second,
        "nano": nano,
        "validDate": 1,
        "validTime": 1,
        "fixType": 3,
        "gnssFixOk": 1,
        "lat": lat,
        "lon": lon,
        "hAcc": 1414,
        "gSpeed": 1500,
        "headMot": 90.0,
    }
    return UBXMessage("NAV", "NAV-PVT", GET, **(fields | changes)).serialize()
