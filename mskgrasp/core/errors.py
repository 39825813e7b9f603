"""The errors that a user can mend: one line that names the value and the remedy."""


class MskgraspError(Exception):
    """Something failed; the message is one line with the value, the legal values and the remedy."""

    exit_code = 1


class UsageError(MskgraspError):
    """What the user typed or wrote into a configuration file cannot be used."""

    exit_code = 2


class BadConfig(UsageError):
    """A YAML file or a command-line override does not describe a valid configuration."""


class BadPart(MskgraspError):
    """A mesh or a part folder cannot be used as a part."""


class TapeDoesNotFit(BadPart):
    """No two tape squares find room on top of the part."""


class UnknownPart(BadPart, UsageError):
    """No part has that name."""


class BadDataset(MskgraspError):
    """A dataset folder or one of its shards is missing, empty, truncated or foreign."""


class BadModel(MskgraspError):
    """A model folder is missing, damaged, or made for other inputs."""


class NoPartFound(MskgraspError):
    """The depth image shows no part that could be grasped."""


class MarkersNotFound(MskgraspError):
    """The tape squares on the part are not seen so that the part's motion could be told from them."""


class NoGraspFound(MskgraspError):
    """No candidate meets what the planner demands."""
