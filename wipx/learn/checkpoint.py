"""The sizes and weights of a trained network as plain arrays: what is needed to train on or to export it anew.

A loop runs the graph of `wipx.learn.onnx_model` instead.
"""

import json
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import torch

from wipx.core.errors import InputError
from wipx.learn.networks.pitch_network import PitchNetwork
from wipx.learn.onnx_model import VERSION
from wipx.learn.recipe import NetworkRecipe

CARD = "card"
REMEDY = "give the estimator.npz that this version of the program wrote, or train again"


def write_network(path: Path, network: PitchNetwork) -> None:
    """Write a network; the file is complete or not there at all."""
    kind, settings = type(network.recipe), asdict(network.recipe)
    name = f"{kind.__module__}.{kind.__name__}"
    card = {"version": VERSION, "recipe": name, "settings": settings, "length": network.length}
    weights = {name: value.numpy() for name, value in network.state_dict().items()}
    partial = path.with_name(f".{path.name}.part.npz")
    np.savez(partial, **{CARD: np.array(json.dumps(card)), **weights})
    partial.replace(path)


def read_network(path: Path) -> PitchNetwork:
    """The network in a file, in evaluation mode; the file names a class of this package and holds no code.

    Raises:
        InputError: the file is missing, holds no network, or one of another version.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            arrays = dict(content)
        card = json.loads(str(arrays.pop(CARD)))
        if card["version"] != VERSION:
            raise InputError(f"{path}: a network of version {card['version']}, expected version {VERSION}; {REMEDY}")
        network = PitchNetwork(_recipe(card["recipe"])(**card["settings"]), card["length"])
        network.load_state_dict({name: torch.as_tensor(value) for name, value in arrays.items()})
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); {REMEDY}") from error
    except (ImportError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, BadZipFile, EOFError) as error:
        raise InputError(f"{path}: no network; {REMEDY}") from error
    return network.eval()


def _recipe(name: str) -> type[NetworkRecipe]:
    """The class of that full name."""
    module, _, kind = name.rpartition(".")
    if not module.startswith("wipx."):
        raise ValueError(name)
    found = vars(import_module(module))[kind]
    if not issubclass(found, NetworkRecipe):
        raise TypeError(name)
    return found
