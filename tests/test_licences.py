"""Every dependency is under a licence that the project's own allows."""

import pytest

from tests.licences import Dependency, dependencies


def test_every_dependency_has_an_allowed_licence():
    found = dependencies()
    assert len(found) > 50 and sum(each.licence is not None for each in found) > 30
    assert [each for each in found if not each.allowed] == []


@pytest.mark.parametrize(
    "licence, core, allowed",
    [
        ("MIT", True, True), ("BSD-3-Clause AND (MIT OR GPL-2.0)", True, True), ("MPL-2.0", True, False),
        ("MPL-2.0", False, True), ("GNU Lesser General Public License v3 (LGPLv3)", False, True),
        ("GNU General Public License v3 (GPLv3)", False, False), ("AGPL-3.0-only", False, False),
        ("GPL-2.0-only AND MIT", True, False), ("?", True, False),
    ],
)  # fmt: skip
def test_what_is_allowed(licence, core, allowed):
    assert Dependency("a", "1", licence, core).allowed == allowed
