"""GPX documents."""

POINT = '<trkpt lat="{0}.5" lon="2.25"><ele>1</ele><time>2023-01-01T00:00:0{0}Z</time>{1}</trkpt>\n'
HEAD = '<?xml version="1.0"?>\n<gpx version="1.0" xmlns="http://www.topografix.com/GPX/1/0">'
TAIL = "</trkseg></trk></gpx>\n"


def document(*points, head=HEAD, name=""):
    return f"{head}<trk>{name}<trkseg>{''.join(points)}{TAIL}".encode()


POINTS = [POINT.format(second, "") for second in range(1, 8)]
WHOLE = document(*POINTS)
