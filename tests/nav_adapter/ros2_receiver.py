"""A receiver without this library: reads topics with types made from .msg files.

``python ros2_receiver.py SECONDS TOPICS DEFINITIONS`` prints "ready", then one JSON object per
message. TOPICS (name to type) and DEFINITIONS (type to text) are JSON objects; types come from
rosbags' registry and from DEFINITIONS.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MADE: dict[str, type[IdlStruct]] = {}


def made(name: str, store: Any) -> type[IdlStruct]:
    if name not in MADE:
        package, _, short = name.split("/")
        fields = {field: idl(node, store) for field, node in store.fielddefs[name][1]}
        MADE[name] = make_idl_struct(short, f"{package}::msg::dds_::{short}_", fields)
    return MADE[name]


def idl(node: Any, store: Any) -> Any:
    kind, content = int(node[0]), node[1]
    if kind == 1:
        name = content[0]
        return {"bool": bool, "string": str}.get(name) or getattr(types, name)
    if kind == 2:
        return made(content, store)
    inner, count = idl(content[0], store), content[1]
    return types.array[inner, count] if kind == 3 else types.sequence[inner]


def plain(value: Any) -> Any:
    if isinstance(value, IdlStruct):
        return {name: plain(getattr(value, name)) for name in value.__annotations__}
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value


def main(seconds: float, wanted: dict[str, str], definitions: dict[str, str]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in definitions.items():
        store.register(get_types_from_msg(text, name))
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    waitset = WaitSet(participant)
    readers = {}
    for name, kind in wanted.items():
        # Nav2's quality of service: see the table in docs/nav2.md.
        latched = kind.endswith("OccupancyGrid")
        best_effort = kind.endswith("PolygonInstanceStamped")
        qos = Qos(
            Policy.Reliability.BestEffort
            if best_effort
            else Policy.Reliability.Reliable(max_blocking_time=0),
            Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
            Policy.History.KeepLast(depth=10),
        )
        topic = Topic(participant, f"rt/{name}", made(kind, store))
        readers[name] = DataReader(participant, topic, qos=qos)
        condition = SampleState.Any | ViewState.Any | InstanceState.Any
        waitset.attach(ReadCondition(readers[name], condition))
    print("ready", flush=True)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        waitset.wait(timeout=50_000_000)
        for name, reader in readers.items():
            for sample in reader.take(N=64):
                if isinstance(sample, IdlStruct):
                    print(json.dumps({"topic": name, "message": plain(sample)}), flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]), json.loads(sys.argv[2]), json.loads(sys.argv[3]))
