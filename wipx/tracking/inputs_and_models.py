"""What a run in MLflow has besides numbers and files: the data that it read, and the estimators that it made."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from wipx.tracking.run_note import DataNote

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.models import ModelSignature

MODEL = "model"  # folder of an estimator among a run's files
REQUIREMENTS = ["onnxruntime", "numpy"]  # of the registered estimators


def log_inputs(client: "MlflowClient", run_id: str, data: Sequence[DataNote]) -> None:
    """Log data sets as inputs of a run; those that it has already stay as they are."""
    from mlflow.entities import Dataset, DatasetInput, InputTag

    inputs = [
        DatasetInput(
            Dataset(one.name, one.digest, "local", json.dumps({"uri": one.source})),
            [InputTag("mlflow.data.context", one.context)],
        )
        for one in data
    ]
    if inputs:
        client.log_inputs(run_id, inputs)


def log_models(client: "MlflowClient", run_id: str, out: Path, models: Mapping[str, str]) -> None:
    """Log estimators with their signatures, and register each as one more version of its name.

    Args:
        client: Of the store.
        run_id: The run that made them.
        out: Its folder.
        models: Names of files with ONNX graphs in `out`, by the name to register.
    """
    if not models or client.search_model_versions(f"run_id = '{run_id}'"):
        return
    import onnx
    from mlflow import onnx as onnx_models
    from mlflow.exceptions import MlflowException

    for name, file in models.items():
        graph = onnx.load_model(out / file)
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder) / MODEL
            signature = _signature(graph)
            onnx_models.save_model(graph, place, signature=signature, pip_requirements=REQUIREMENTS)
            client.log_artifacts(run_id, str(place), MODEL)
        try:
            client.create_registered_model(name)
        except MlflowException as error:
            if error.error_code != "RESOURCE_ALREADY_EXISTS":
                raise
        uri = client.get_run(run_id).info.artifact_uri
        client.create_model_version(name, f"{uri}/{MODEL}", run_id)


def _signature(graph) -> "ModelSignature":
    """Names, types and shapes of a graph's inputs and outputs; an unknown length is -1."""
    import onnx
    from mlflow.models import ModelSignature
    from mlflow.types import Schema, TensorSpec

    def spec(value) -> TensorSpec:
        kind = value.type.tensor_type
        shape = tuple(d.dim_value if d.HasField("dim_value") else -1 for d in kind.shape.dim)
        return TensorSpec(onnx.helper.tensor_dtype_to_np_dtype(kind.elem_type), shape, value.name)

    return ModelSignature(
        Schema([spec(value) for value in graph.graph.input]), Schema([spec(value) for value in graph.graph.output])
    )
