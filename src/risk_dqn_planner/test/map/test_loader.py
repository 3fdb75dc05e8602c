# SPDX-License-Identifier: Apache-2.0
import math
from collections.abc import Callable
from pathlib import Path

import lanelet2
import pytest
from lanelet2.core import Lanelet, LaneletMap, LineString3d, Point3d

from risk_dqn_planner.errors import (
    ConfigurationError,
    MapFileError,
    MapProjectionError,
    UnknownLaneletError,
)
from risk_dqn_planner.map.loader import MapOrigin, load_map

ORIGIN = MapOrigin(49.0, 8.4)
BIG_ID = 9_100_000_000_000_000_001


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    """One lanelet with a large negative id, 50 m to the north of the origin, with local tags."""
    lines = []
    for number, x in enumerate((-1.75, 1.75)):
        points = [Point3d(10 * number + k, x, y, 0.0) for k, y in ((1, 0.0), (2, 50.0))]
        for point in points:
            point.attributes["local_x"] = str(1000.0 + point.x)
            point.attributes["local_y"] = str(2000.0 + point.y)
        lines.append(LineString3d(100 + number, points))
    lanelet = Lanelet(-BIG_ID, lines[0], lines[1])
    lanelet.attributes["subtype"] = "road"
    lanelet.attributes["location"] = "urban"
    lanelet_map = LaneletMap()
    lanelet_map.add(lanelet)
    path = tmp_path / "map.osm"
    origin = lanelet2.io.Origin(ORIGIN.latitude_deg, ORIGIN.longitude_deg)
    lanelet2.io.write(str(path), lanelet_map, lanelet2.projection.UtmProjector(origin))
    return path


@pytest.mark.parametrize("projector", ["utm", "local_cartesian"])
def test_a_map_is_loaded_about_its_origin(map_file: Path, projector: str) -> None:
    road_map = load_map(map_file, ORIGIN, projector)
    points = road_map.lanelet(-BIG_ID).leftBound
    # Grid north of UTM is turned by 0.45 degrees there, and its scale is 0.9996.
    assert (points[0].x, points[0].y) == pytest.approx((-1.75, 0.0), abs=0.03)
    assert (points[-1].x, points[-1].y) == pytest.approx((-1.75, 50.0), abs=0.6)
    assert road_map.drivable(road_map.lanelet(-BIG_ID))
    assert road_map.origin == ORIGIN
    assert road_map.notes == ()


def test_local_coordinates_are_taken_from_the_tags_and_can_be_searched(map_file: Path) -> None:
    road_map = load_map(map_file, None, "local_xy")
    line = road_map.lanelet(-BIG_ID).centerline
    assert (line[0].x, line[0].y) == pytest.approx((1000.0, 2000.0))
    assert (line[-1].x, line[-1].y) == pytest.approx((1000.0, 2050.0))
    corner = lanelet2.core.BasicPoint2d
    box = lanelet2.core.BoundingBox2d(corner(999.0, 1999.0), corner(1001.0, 2001.0))
    assert [item.id for item in road_map.lanelet_map.laneletLayer.search(box)] == [-BIG_ID]
    assert road_map.origin is None


def test_local_coordinates_need_no_latitude(map_file: Path) -> None:
    text = map_file.read_text()
    for key in ("lat", "lon"):
        text = text.replace(f' {key}="4', f' {key}="" was="4').replace(
            f' {key}="8', f' {key}="" was="8'
        )
    map_file.write_text(text)
    with pytest.raises(MapProjectionError, match='try projector "local_xy"'):
        load_map(map_file, ORIGIN)
    road_map = load_map(map_file, None, "local_xy")
    line = road_map.lanelet(-BIG_ID).leftBound
    assert (line[0].x, line[0].y) == pytest.approx((998.25, 2000.0))


def test_local_coordinates_that_are_missing_name_the_point(map_file: Path) -> None:
    map_file.write_text(map_file.read_text().replace("local_x", "easting"))
    with pytest.raises(MapProjectionError, match=r"point \d+ of .*map\.osm has no numbers"):
        load_map(map_file, None, "local_xy")


def test_without_an_origin_the_first_node_is_taken(map_file: Path) -> None:
    road_map = load_map(map_file)
    assert road_map.origin is not None
    assert road_map.origin.distance_m(ORIGIN) < 60.0
    xs = [point.x for point in road_map.lanelet_map.pointLayer]
    assert max(map(abs, xs)) < 60.0


def test_an_origin_far_from_the_map_tells_how_far_and_what_to_pass(map_file: Path) -> None:
    # One degree of latitude: 6371 km * pi / 180 = 111 km.
    with pytest.raises(MapProjectionError, match=r"lies 111 km from the origin 50,8\.4.*49"):
        load_map(map_file, MapOrigin(50.0, 8.4))


def test_distance_between_origins_is_along_the_great_circle() -> None:
    quarter = 0.5 * math.pi * 6_371_000.0
    assert MapOrigin(0.0, 0.0).distance_m(MapOrigin(0.0, 90.0)) == pytest.approx(quarter)
    assert MapOrigin(0.0, 0.0).distance_m(MapOrigin(90.0, 0.0)) == pytest.approx(quarter)


def test_an_unknown_projector_lists_the_valid_ones(map_file: Path) -> None:
    with pytest.raises(ConfigurationError, match="utm, local_cartesian, mercator, local_xy"):
        load_map(map_file, ORIGIN, "gauss_krueger")


def test_an_unknown_location_is_refused(map_file: Path) -> None:
    with pytest.raises(ConfigurationError, match="no traffic rules for location 'atlantis'"):
        load_map(map_file, ORIGIN, location="atlantis")


@pytest.mark.parametrize("lanelet_id", [7, BIG_ID, 2**63, -(2**70)])
def test_an_unknown_lanelet_is_named(map_file: Path, lanelet_id: int) -> None:
    with pytest.raises(UnknownLaneletError, match=rf"lanelet {lanelet_id} .*map\.osm"):
        load_map(map_file, ORIGIN).lanelet(lanelet_id)


def missing(folder: Path) -> Path:
    return folder / "absent.osm"


def directory(folder: Path) -> Path:
    (folder / "folder.osm").mkdir()
    return folder / "folder.osm"


def other_suffix(folder: Path) -> Path:
    (folder / "map.xml").write_text("<osm/>")
    return folder / "map.xml"


def written(text: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / "bad.osm").write_text(text)
        return folder / "bad.osm"

    return write


NODE = "<node id='1' lat='49' lon='8.4'/>"


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (missing, "does not exist"),
        (directory, "not a file"),
        (other_suffix, r"ending in \.osm"),
        (written(""), "is not an OSM file"),
        (written("<html></html>"), "is not an OSM file"),
        (written(f"<osm>{NODE}<way id='2'"), "cannot be parsed"),
        (written(f"<osm version='0.6'>{NODE}</osm>"), "has no lanelet"),
    ],
)
def test_a_file_that_is_no_map_is_refused_with_its_name_and_the_reason(
    tmp_path: Path, make: Callable[[Path], Path], reason: str
) -> None:
    path = make(tmp_path)
    with pytest.raises(MapFileError, match=reason) as caught:
        load_map(path, ORIGIN)
    assert path.name in str(caught.value)


def test_what_cannot_be_read_in_a_map_is_noted(map_file: Path) -> None:
    rule = (
        "<relation id='77'><tag k='type' v='regulatory_element'/>"
        "<tag k='subtype' v='flying_carpet'/></relation></osm>"
    )
    map_file.write_text(map_file.read_text().replace("</osm>", rule))
    (note,) = load_map(map_file, ORIGIN).notes
    assert "77" in note
    assert "flying_carpet" in note


@pytest.mark.parametrize("text", ["", "49", "49,8,4", "here,there"])
def test_an_origin_that_is_not_two_numbers_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"expected latitude,longitude such as 49\.0,8\.4"):
        MapOrigin.from_text(text)


@pytest.mark.parametrize("text", ["91,0", "0,181", "nan,0"])
def test_an_origin_off_the_globe_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="latitude within 90"):
        MapOrigin.from_text(text)


def test_an_origin_is_read_from_text() -> None:
    assert MapOrigin.from_text("50.970, 6.852") == MapOrigin(50.97, 6.852)
