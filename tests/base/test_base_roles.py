"""The order of the roles."""

import pytest

from webmap.base.roles import ROLES, covers, who_may


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("least", ROLES)
def test_a_role_covers_itself_and_those_before_it(role, least):
    assert covers(role, least) == (ROLES.index(role) >= ROLES.index(least))


def test_the_sentence_names_who_may():
    assert who_may("operator") == "Only an operator may do this."
    assert who_may("admin") == "Only an admin may do this."
