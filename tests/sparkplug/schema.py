"""The published schema of Sparkplug B (specification 6.4.1) in Google's own Protocol Buffers: the independent opinion.

Made from a table, so that the tests need no compiler. `text` gives the messages their classes.
"""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("google.protobuf")

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

__all__ = ["DecodeError", "ForeignPayload", "foreign"]

PACKAGE = "org.eclipse.tahu.protobuf"
_LABELS = {"optional": 1, "repeated": 3, "oneof": 1}
_TYPES = {"double": 1, "float": 2, "uint64": 4, "bool": 8, "string": 9, "bytes": 12, "uint32": 13}
_MESSAGE_TYPE = 11
_SCALARS = ("int uint32", "long uint64", "float float", "double double", "boolean bool", "string string")


def _values(first: int, *more: str) -> list[str]:
    """The fields of a `oneof value`, numbered from the first on."""
    return [
        f"oneof {kind} {name}_value {first + offset}"
        for offset, (name, kind) in enumerate(one.split() for one in (*_SCALARS, *more))
    ]


MESSAGES: dict[str, list[str]] = {
    "Payload": [
        "optional uint64 timestamp 1",
        "repeated .Payload.Metric metrics 2",
        "optional uint64 seq 3",
        "optional string uuid 4",
        "optional bytes body 5",
    ],
    "Payload.Template": [
        "optional string version 1",
        "repeated .Payload.Metric metrics 2",
        "repeated .Payload.Template.Parameter parameters 3",
        "optional string template_ref 4",
        "optional bool is_definition 5",
    ],
    "Payload.Template.Parameter": [
        "optional string name 1",
        "optional uint32 type 2",
        *_values(3, "extension .Payload.Extension"),
    ],
    "Payload.DataSet": [
        "optional uint64 num_of_columns 1",
        "repeated string columns 2",
        "repeated uint32 types 3",
        "repeated .Payload.DataSet.Row rows 4",
    ],
    "Payload.DataSet.DataSetValue": _values(1, "extension .Payload.Extension"),
    "Payload.DataSet.Row": ["repeated .Payload.DataSet.DataSetValue elements 1"],
    "Payload.PropertyValue": [
        "optional uint32 type 1",
        "optional bool is_null 2",
        *_values(
            3,
            "propertyset .Payload.PropertySet",
            "propertysets .Payload.PropertySetList",
            "extension .Payload.Extension",
        ),
    ],
    "Payload.PropertySet": ["repeated string keys 1", "repeated .Payload.PropertyValue values 2"],
    "Payload.PropertySetList": ["repeated .Payload.PropertySet propertyset 1"],
    "Payload.MetaData": [
        "optional bool is_multi_part 1",
        "optional string content_type 2",
        "optional uint64 size 3",
        "optional uint64 seq 4",
        "optional string file_name 5",
        "optional string file_type 6",
        "optional string md5 7",
        "optional string description 8",
    ],
    "Payload.Metric": [
        "optional string name 1",
        "optional uint64 alias 2",
        "optional uint64 timestamp 3",
        "optional uint32 datatype 4",
        "optional bool is_historical 5",
        "optional bool is_transient 6",
        "optional bool is_null 7",
        "optional .Payload.MetaData metadata 8",
        "optional .Payload.PropertySet properties 9",
        *_values(
            10,
            "bytes bytes",
            "dataset .Payload.DataSet",
            "template .Payload.Template",
            "extension .Payload.Extension",
        ),
    ],
    "Payload.Extension": [],
}
"""Message -> its fields: label, type, name, number. One empty message stands for all extensions."""


def _payload_class() -> Any:
    file = descriptor_pb2.FileDescriptorProto(name="sparkplug_b.proto", package=PACKAGE, syntax="proto2")
    made: dict[str, Any] = {}
    for name, fields in sorted(MESSAGES.items()):
        outer, _, own = name.rpartition(".")
        message = made[outer].nested_type.add(name=own) if outer else file.message_type.add(name=own)
        made[name] = message
        for line in fields:
            label, kind, field_name, number = line.split()
            field = message.field.add(name=field_name, number=int(number), label=_LABELS[label])
            if kind.startswith("."):
                field.type, field.type_name = _MESSAGE_TYPE, f".{PACKAGE}{kind}"
            else:
                field.type = _TYPES[kind]
            if label == "oneof":
                if not message.oneof_decl:
                    message.oneof_decl.add(name="value")
                field.oneof_index = 0
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.Payload"))


ForeignPayload = _payload_class()


def foreign(data: bytes) -> Any:
    """What Google's implementation reads in the bytes."""
    payload = ForeignPayload()
    payload.ParseFromString(data)
    return payload
