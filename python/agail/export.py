"""agail export: a policy as one ONNX graph."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agail import _core
from agail._core import InputError, Policy
from agail._extension import Parser, missing, run, unwritten

if TYPE_CHECKING:
    import onnx

OPSET, IR_VERSION = 17, 8  # of 2022, which every runtime in use reads


class _Graph:
    """A chain of operations on one value."""

    def __init__(self, value: str):
        self.value = value
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, name: str, array: np.ndarray) -> str:
        from onnx import numpy_helper

        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def then(self, operation: str, *others: str, to: str | None = None, **attributes: Any) -> str:
        from onnx import helper

        result = to or f"{operation.lower()}_{len(self.nodes)}"
        self.nodes.append(
            helper.make_node(operation, [self.value, *others], [result], **attributes)
        )
        self.value = result
        return result


def _float32(array: np.ndarray) -> np.ndarray:
    return np.asarray(array, np.float32)


def _build(policy: Policy) -> tuple[_Graph, list[tuple[str, Any, list[Any]]]]:
    """The graph, and its outputs: name, type, shape."""
    from onnx import TensorProto

    tensors, structure = policy.tensors(), json.loads(policy.metadata()["structure"])
    graph = _Graph("observation")
    if structure["normalize_observations"]:
        clip = np.float32(structure["observation_clip"])
        graph.then("Sub", graph.constant("observation.mean", _float32(tensors["observation.mean"])))
        scale = _float32(1 / tensors["observation.std"])
        graph.then("Mul", graph.constant("observation.scale", scale))
        limits = graph.constant("clip.low", -clip), graph.constant("clip.high", clip)
        graph.then("Clip", *limits)
    layers = len(structure["hidden"]) + 1
    for layer in range(layers):
        last = layer == layers - 1
        names = [f"policy.{layer}.{part}" for part in ("weight", "bias")]
        weight, bias = (graph.constant(name, tensors[name]) for name in names)
        output = ("logits" if structure["discrete"] else "mean") if last else None
        graph.then("Gemm", weight, bias, to=output, transB=1)
        if not last:
            graph.then("Tanh")
    if structure["discrete"]:
        (start,) = structure.get("layout", {}).get("action_start", [0])
        graph.then("ArgMax", to=None if start else "action", axis=1, keepdims=0)
        if start:
            graph.then("Add", graph.constant("action.start", np.int64(start)), to="action")
        logits = ("logits", TensorProto.FLOAT, ["n", structure["actions"]])
        return graph, [("action", TensorProto.INT64, ["n"]), logits]
    from onnx import helper

    # Bounds that are infinite stay so.
    low, high = (
        graph.constant(
            f"action.{name}", np.array([float(v) for v in structure[f"action_{name}"]], np.float32)
        )
        for name in ("low", "high")
    )
    graph.then("Max", low)
    graph.then("Min", high, to="action")
    zero = graph.constant("zero", np.float32(0))
    log_std = graph.constant("policy.log_std", tensors["policy.log_std"])
    graph.nodes.append(helper.make_node("Mul", ["mean", zero], ["zeros"]))
    graph.nodes.append(helper.make_node("Add", ["zeros", log_std], ["log_std"]))
    shape = ["n", structure["action_dim"]]
    names = ("action", "log_std", "mean")
    return graph, [(name, TensorProto.FLOAT, shape) for name in names]


def to_onnx(policy: Policy) -> onnx.ModelProto:
    """One graph with normalisation and network.

    Input: observation, float32 (n, observation_dim), the environment's numbers in a row (of a
    Discrete space one-hot). Outputs: action, what predict() gives (float32 (n, action_dim), in a row
    whatever the shape of the space is, or int64 (n,)); log_std and mean (continuous: of
    the Gaussian before it is clipped to the bounds), or logits. Metadata: environment, method,
    timesteps, settings, structure.
    """
    try:
        from onnx import TensorProto, checker, helper
    except ImportError as error:
        raise missing("onnx", "onnx") from error
    graph, outputs = _build(policy)
    inputs = [("observation", TensorProto.FLOAT, ["n", policy.observation_dim])]
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "agail_policy",
            [helper.make_tensor_value_info(*each) for each in inputs],
            [helper.make_tensor_value_info(*each) for each in outputs],
            graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="agail",
        producer_version=_core.version,
    )
    helper.set_model_props(model, policy.metadata())
    checker.check_model(model)
    return model


def export(policy: Policy, path: str | os.PathLike[str]) -> None:
    """Writes to_onnx(policy) to a file: whole or not at all.

    InputError if it cannot be created there; RuntimeError if the disk is full.
    """
    data = to_onnx(policy).SerializeToString()
    path = Path(path)
    if not path.name or path.is_dir():
        raise InputError(f"{path}: cannot be written, it is a folder; give another --out")
    part = path.with_name(f".{path.name[:40]}.{os.getpid()}.tmp")
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        raise unwritten(path, error, "give another --out") from error
    finally:
        with contextlib.suppress(OSError):  # none is there
            part.unlink()


def main() -> None:
    parser = Parser("agail export", description="A policy as a file for other programs.")
    parser.add_argument("policy", metavar="POLICY", help="a run folder or a .safetensors file")
    parser.add_argument("--format", choices=["onnx"], default="onnx")
    parser.add_argument("--out", required=True, help="the file to write")
    options = parser.parse_args()

    def work() -> None:
        policy = Policy.load(options.policy)
        export(policy, options.out)
        print(f"{options.out}: {policy.method} policy for {policy.environment}")

    run(work)
