"""Names of joints and bodies that recordings, sites and effects cannot have."""

from pathlib import Path

from wipx.core.errors import InputError
from wipx.core.tree import Tree

MARKS = "/,=;\"'"  # site/kind, cells of a CSV, KEY=VALUE
SITES = ("actuator", "environment")


def check_names(tree: Tree, path: Path) -> None:
    """Refuse names that would stand for two columns or two sites.

    Args:
        tree: The robot.
        path: Its model file, for messages.

    Raises:
        InputError: the message names the joint or body, and what it clashes with.
    """
    for what, name in (*(("joint", link.joint) for link in tree.links), *(("body", link.body) for link in tree.links)):
        for mark in MARKS:
            if mark in name:
                raise InputError(f"{path}: {what} {name} has {mark!r} in its name, which names of sites use; rename it")
    columns = {"t": "time"}
    sites = {site: f"the site {site}" for site in SITES}
    for joint in tree.joints:
        own = {
            joint: f"the position of joint {joint}",
            f"{joint}_dot": f"the rate of joint {joint}",
            f"u_{joint}": f"the command of joint {joint}",
            f"u_{joint}_measured": f"the measured force of joint {joint}",
        }
        for column, meaning in own.items():
            if column in columns:
                raise InputError(
                    f"{path}: the column {column} would be {columns[column]} and {meaning}; rename joint {joint}"
                )
        columns |= own
    for link in tree.links:
        places = (link.joint, f"actuator_{link.joint}", f"sensor_{link.joint}", f"link_{link.body}")
        for site in places:
            if site in sites:
                raise InputError(
                    f"{path}: joint {link.joint} would share the name {site} with {sites[site]}; rename it"
                )
        sites |= {site: f"joint {link.joint} or its link" for site in places}
