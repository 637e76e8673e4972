"""Names that no system has: those of modules that Python could take its package for."""

import sys

from specc.lang.packages import PACKAGES
from tests.house.tree import modules


def test_modules_of_this_python_are_in_the_list() -> None:
    assert sys.stdlib_module_names <= PACKAGES


def test_what_specc_and_its_runtime_import_is_in_the_list() -> None:
    """The list is a fixed one, the same on all machines."""
    ours = (*modules(".", "specc"), *modules("runtime", "specc_runtime"))
    imported = {name.partition(".")[0] for module in ours for name in module.imports()}
    assert {"numpy", "specc", "specc_runtime", "rclpy"} <= imported
    assert imported <= PACKAGES
