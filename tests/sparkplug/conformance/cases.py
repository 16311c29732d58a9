"""The normative statements of Eclipse Sparkplug 3.0.0 that concern an edge node, by the ids of its compatibility kit.

The ids are the specification's, without `tck-id-`; what a statement asks is said here in our words. Those about host
applications and MQTT servers are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import pytest

Test = TypeVar("Test", bound=Callable[..., None])


def tck(*names: str) -> Callable[[Test], Test]:
    """Marks a test as showing these statements: it has one case for each."""

    def marked(test: Test) -> Test:
        cases: Test = pytest.mark.parametrize("tck_id", names, indirect=True)(test)
        needed: Test = pytest.mark.usefixtures("tck_id")(cases)
        return needed

    return marked


@dataclass(frozen=True)
class Statement:
    """One statement, and why it does not apply, if it does not."""

    name: str
    asks: str
    why_not: str = ""


_PLANT = "it is up to the people who name the nodes of a plant"
_NO_TEMPLATES = "no templates are published"
_NO_DATA_SETS = "no data sets are published"

_TEXT = """
# 1 Introduction
intro-group-id-string: the group id is a UTF-8 string
intro-group-id-chars: of characters that MQTT allows in topics
intro-edge-node-id-string: the edge node id is a UTF-8 string
intro-edge-node-id-chars: of characters that MQTT allows in topics
intro-edge-node-id-uniqueness: the edge node id is unique in its group | PLANT
intro-device-id-string: the device id is a UTF-8 string
intro-device-id-chars: of characters that MQTT allows in topics
# 2 Principles
principles-rbe-recommended: data is published when it changes, not periodically
principles-birth-certificates-order: births are the first messages
principles-persistence-clean-session-311: MQTT 3.1.1: the session is clean
principles-persistence-clean-session-50: MQTT 5: clean start, and no session expiry
# 4 Topics and messages
topic-structure: namespace/group/type/node/[device]
topic-structure-namespace-a: the namespace is spBv1.0
topic-structure-namespace-valid-group-id: a group id without + / #
topic-structure-namespace-unique-edge-node-descriptor: group and edge node id are unique together | PLANT
topic-structure-namespace-valid-edge-node-id: an edge node id without + / #
topic-structure-namespace-valid-device-id: a device id without + / #
topic-structure-namespace-unique-device-id: no two devices of a node have one id
topic-structure-namespace-duplicate-device-id-across-edge-node: devices of different nodes may
topic-structure-namespace-device-id-associated-message-types: the device is in the topics of DBIRTH, DDEATH, DDATA, DCMD
topic-structure-namespace-device-id-non-associated-message-types: and in no others
topics-nbirth-topic: topic of NBIRTH
topics-nbirth-mqtt: NBIRTH has QoS 0 and is not retained
topics-nbirth-seq-num: NBIRTH has the sequence number 0
topics-nbirth-timestamp: NBIRTH says when it was sent
topics-nbirth-metric-reqs: NBIRTH has every metric of the node
topics-nbirth-metrics: each with name, data type and value
topics-nbirth-templates: NBIRTH has all template definitions | NO_TEMPLATES
topics-nbirth-bdseq-included: NBIRTH has bdSeq
topics-nbirth-bdseq-matching: that of the will
topics-nbirth-bdseq-increment: bdSeq begins at 0 and goes up by one with each CONNECT
topics-nbirth-rebirth-metric: NBIRTH has `Node Control/Rebirth`, a Boolean that is false
topics-ndata-topic: topic of NDATA
topics-ndata-mqtt: NDATA has QoS 0 and is not retained
topics-ndata-seq-num: NDATA has the next sequence number, 0 after 255
topics-ndata-timestamp: NDATA says when it was sent
topics-ndata-payload: NDATA has the metrics that have changed
topics-ndeath-topic: topic of NDEATH
topics-ndeath-payload: NDEATH has bdSeq and no other metric
topics-ndeath-seq: NDEATH has no sequence number
topics-ncmd-topic: topic of NCMD
topics-dbirth-topic: topic of DBIRTH
topics-dbirth-mqtt: DBIRTH has QoS 0 and is not retained
topics-dbirth-seq: DBIRTH has the next sequence number, 0 after 255
topics-dbirth-timestamp: DBIRTH says when it was sent
topics-dbirth-metric-reqs: DBIRTH has every metric of the device
topics-dbirth-metrics: each with name, data type and value
topics-ddata-topic: topic of DDATA
topics-ddata-mqtt: DDATA has QoS 0 and is not retained
topics-ddata-seq-num: DDATA has the next sequence number, 0 after 255
topics-ddata-timestamp: DDATA says when it was sent
topics-ddata-payload: DDATA has the metrics that have changed
topics-ddeath-topic: topic of DDEATH
topics-ddeath-mqtt: DDEATH has QoS 0 and is not retained
topics-ddeath-seq-num: DDEATH has the next sequence number, 0 after 255
topics-dcmd-topic: topic of DCMD
# 5 Operational behaviour
case-sensitivity-sparkplug-ids: ids should differ in more than case | the mapping names them; a recommendation
case-sensitivity-metric-names: metrics should differ in more than case | the mapping names them; a recommendation
message-flow-edge-node-ncmd-subscribe: the node subscribes to its NCMD with QoS 1
PUBLISH-connect: there is an MQTT session before births
PUBLISH-will-message: CONNECT has a will
PUBLISH-will-message-topic: on the topic of NDEATH
PUBLISH-will-message-payload: a Sparkplug payload
PUBLISH-will-message-payload-bdSeq: with bdSeq, an Int64, one more with each CONNECT, 0 after 255
PUBLISH-will-message-qos: QoS 1
PUBLISH-will-message-will-retained: not retained
PUBLISH-phid-wait: births wait for the primary host
PUBLISH-phid-wait-id: for the one of this id
PUBLISH-phid-wait-online: until its STATE says that it is online
PUBLISH-phid-wait-timestamp: with a timestamp not before that of the STATE before
PUBLISH-nbirth-topic: topic of NBIRTH
PUBLISH-nbirth-payload: a Sparkplug payload
PUBLISH-nbirth-payload-bdSeq: with bdSeq, an Int64, that of CONNECT
PUBLISH-nbirth-qos: QoS 0
PUBLISH-nbirth-retained: not retained
PUBLISH-nbirth-payload-seq: with a sequence number from 0 to 255
PUBLISH-phid-offline: the primary host is offline: NDEATH, leave, connect anew
operational-behavior-edge-node-intentional-disconnect-ndeath: NDEATH before the connection is ended on purpose
operational-behavior-edge-node-intentional-disconnect-packet: then DISCONNECT may be sent
operational-behavior-edge-node-termination-host-offline: the primary host is offline: disconnect
operational-behavior-edge-node-termination-host-offline-reconnect: and connect to the next or the same server
operational-behavior-edge-node-termination-host-offline-timestamp: not if its timestamp is older than the last
message-flow-device-dcmd-subscribe: DCMD of a device with outputs is subscribed to with QoS 1
message-flow-device-birth-publish-nbirth-wait: NBIRTH before DBIRTH
message-flow-device-birth-publish-dbirth-topic: topic of DBIRTH
message-flow-device-birth-publish-dbirth-match-edge-node-topic: with group and node of NBIRTH
message-flow-device-birth-publish-dbirth-payload: a Sparkplug payload
message-flow-device-birth-publish-dbirth-qos: QoS 0
message-flow-device-birth-publish-dbirth-retained: not retained
message-flow-device-birth-publish-dbirth-payload-seq: with the next sequence number
operational-behavior-device-ddeath: a device that is lost gets a DDEATH
MULTIPLE-state-subs: the node subscribes to STATE of its primary host
MULTIPLE-single-server: one server at a time
MULTIPLE-walk: the primary host is offline: to the next server
operational-behavior-edge-node-birth-sequence-wait: births wait for STATE on the new server
operational-behavior-data-publish-nbirth: NBIRTH has all metrics that the session will have
operational-behavior-data-publish-nbirth-values: with their values, or null
operational-behavior-data-publish-nbirth-change: NDATA only when a metric changes
operational-behavior-data-publish-nbirth-order: values of now in the order of their times
operational-behavior-data-publish-dbirth: DBIRTH has all metrics that the session will have
operational-behavior-data-publish-dbirth-values: with their values, or null
operational-behavior-data-publish-dbirth-change: DDATA only when a metric changes
operational-behavior-data-publish-dbirth-order: values of now in the order of their times
operational-behavior-data-commands-rebirth-name: NBIRTH has `Node Control/Rebirth`
operational-behavior-data-commands-rebirth-name-aliases: without an alias
operational-behavior-data-commands-rebirth-datatype: a Boolean
operational-behavior-data-commands-rebirth-value: false
operational-behavior-data-commands-ncmd-rebirth-verb: a rebirth is asked for by NCMD
operational-behavior-data-commands-ncmd-rebirth-name: by its name
operational-behavior-data-commands-ncmd-rebirth-value: with true
operational-behavior-data-commands-rebirth-action-1: data stops
operational-behavior-data-commands-rebirth-action-2: NBIRTH and every DBIRTH follow
operational-behavior-data-commands-rebirth-action-3: with the bdSeq of CONNECT
operational-behavior-data-commands-ncmd-verb: metrics of the node are written by NCMD
operational-behavior-data-commands-ncmd-metric-name: by a name that the birth had
operational-behavior-data-commands-ncmd-metric-value: with a value that fits
operational-behavior-data-commands-dcmd-verb: metrics of a device are written by DCMD
operational-behavior-data-commands-dcmd-metric-name: by a name that the birth had
operational-behavior-data-commands-dcmd-metric-value: with a value that fits
# 6 Payloads
payloads-timestamp-in-UTC: timestamps of payloads are milliseconds of UTC
payloads-sequence-num-always-included: all messages but NDEATH have a sequence number
payloads-sequence-num-zero-nbirth: NBIRTH has 0
payloads-sequence-num-incrementing: it goes up by one, to 0 after 255
payloads-name-requirement: metrics have a name, unless aliases are used
payloads-alias-uniqueness: an alias is unique in the edge node
payloads-alias-birth-requirement: births have name and alias
payloads-alias-data-cmd-requirement: data has the alias alone
payloads-name-birth-data-requirement: metrics of births and data have a timestamp
payloads-name-cmd-requirement: metrics of commands may have one
payloads-metric-timestamp-in-UTC: timestamps of metrics are milliseconds of UTC
payloads-metric-datatype-value-type: the data type is a uint32
payloads-metric-datatype-value: one of the list
payloads-metric-datatype-req: metrics of births have one
payloads-metric-datatype-not-req: metrics of data should have none
payloads-propertyset-keys-array-size: a property set has as many keys as values
payloads-propertyset-values-array-size: and as many values as keys
payloads-metric-propertyvalue-type-type: the type of a property is a uint32
payloads-metric-propertyvalue-type-value: one of the list
payloads-metric-propertyvalue-type-req: properties of births have one
payloads-propertyset-quality-value-type: Quality is an Int32
payloads-propertyset-quality-value-value: 0, 192 or 500
payloads-dataset-column-size: number of columns | NO_DATA_SETS
payloads-dataset-column-num-headers: as many names as types | NO_DATA_SETS
payloads-dataset-types-def: types are uint32 | NO_DATA_SETS
payloads-dataset-types-num: as many types as names | NO_DATA_SETS
payloads-dataset-types-type: types are uint32 | NO_DATA_SETS
payloads-dataset-types-value: types are those of the list | NO_DATA_SETS
payloads-dataset-parameter-type-req: types are there | NO_DATA_SETS
payloads-template-dataset-value: values are of basic types | NO_DATA_SETS
payloads-template-definition-nbirth-only: definitions are in NBIRTH alone | NO_TEMPLATES
payloads-template-definition-is-definition: definitions say so | NO_TEMPLATES
payloads-template-definition-ref: definitions have no reference | NO_TEMPLATES
payloads-template-definition-members: definitions have all members | NO_TEMPLATES
payloads-template-definition-nbirth: definitions of all instances are there | NO_TEMPLATES
payloads-template-definition-parameters: definitions have all parameters | NO_TEMPLATES
payloads-template-definition-parameters-default: with default values | NO_TEMPLATES
payloads-template-instance-is-definition: instances say so | NO_TEMPLATES
payloads-template-instance-ref: instances have a reference | NO_TEMPLATES
payloads-template-instance-members: instances have members of the definition | NO_TEMPLATES
payloads-template-instance-members-birth: all of them in births | NO_TEMPLATES
payloads-template-instance-members-data: some of them in data | NO_TEMPLATES
payloads-template-instance-parameters: instances may have parameters | NO_TEMPLATES
payloads-template-version: a version is a string | NO_TEMPLATES
payloads-template-ref-definition: definitions have no reference | NO_TEMPLATES
payloads-template-ref-instance: a reference is a string | NO_TEMPLATES
payloads-template-is-definition: is_definition is there | NO_TEMPLATES
payloads-template-is-definition-definition: true in definitions | NO_TEMPLATES
payloads-template-is-definition-instance: false in instances | NO_TEMPLATES
payloads-template-parameter-name-required: parameters have names | NO_TEMPLATES
payloads-template-parameter-name-type: names are strings | NO_TEMPLATES
payloads-template-parameter-value-type: types are uint32 | NO_TEMPLATES
payloads-template-parameter-type-value: types are those of the list | NO_TEMPLATES
payloads-template-parameter-type-req: types are there in births | NO_TEMPLATES
payloads-template-parameter-value: values are of basic types | NO_TEMPLATES
payloads-nbirth-timestamp: NBIRTH says when it was sent
payloads-nbirth-edge-node-descriptor: group and edge node id are unique | PLANT
payloads-nbirth-seq: NBIRTH has the sequence number 0
payloads-nbirth-bdseq: NBIRTH has bdSeq
payloads-nbirth-bdseq-repeat: the same in every NBIRTH of a session
payloads-nbirth-rebirth-req: NBIRTH has `Node Control/Rebirth`, false
payloads-nbirth-qos: QoS 0
payloads-nbirth-retain: not retained
payloads-dbirth-timestamp: DBIRTH says when it was sent
payloads-dbirth-seq: DBIRTH has a sequence number
payloads-dbirth-seq-inc: the next
payloads-dbirth-order: DBIRTH follows NBIRTH before any data
payloads-dbirth-qos: QoS 0
payloads-dbirth-retain: not retained
payloads-ndata-timestamp: NDATA says when it was sent
payloads-ndata-seq: NDATA has a sequence number
payloads-ndata-seq-inc: the next
payloads-ndata-order: NDATA after all births
payloads-ndata-qos: QoS 0
payloads-ndata-retain: not retained
payloads-ddata-timestamp: DDATA says when it was sent
payloads-ddata-seq: DDATA has a sequence number
payloads-ddata-seq-inc: the next
payloads-ddata-order: DDATA after all births
payloads-ddata-qos: QoS 0
payloads-ddata-retain: not retained
payloads-ndeath-seq: NDEATH has no sequence number
payloads-ndeath-will-message: NDEATH is the will of CONNECT
payloads-ndeath-will-message-qos: QoS 1
payloads-ndeath-will-message-retain: not retained
payloads-ndeath-bdseq: NDEATH has the bdSeq of its NBIRTH
payloads-ndeath-will-message-publisher: the node publishes NDEATH itself when it ends the connection
payloads-ndeath-will-message-publisher-disconnect-mqtt311: MQTT 3.1.1: before DISCONNECT
payloads-ndeath-will-message-publisher-disconnect-mqtt50: MQTT 5: DISCONNECT says "disconnect with will message"
payloads-ddeath-timestamp: DDEATH says when it was sent
payloads-ddeath-seq: DDEATH has a sequence number
payloads-ddeath-seq-inc: the next
payloads-ddeath-seq-number: in the order of the session
"""
_SHORT = {
    "PUBLISH-": "message-flow-edge-node-birth-publish-",
    "MULTIPLE-": "operational-behavior-primary-application-state-with-multiple-servers-",
}
_REASONS = {"PLANT": _PLANT, "NO_TEMPLATES": _NO_TEMPLATES, "NO_DATA_SETS": _NO_DATA_SETS}


def _chapters() -> dict[str, list[Statement]]:
    chapters: dict[str, list[Statement]] = {}
    for line in _TEXT.strip().splitlines():
        if line.startswith("# "):
            chapters[line[2:]] = []
            continue
        name, _, asks = line.partition(": ")
        for short, whole in _SHORT.items():
            name = name.replace(short, whole)
        asks, _, why = asks.partition(" | ")
        next(reversed(chapters.values())).append(Statement(name, asks, _REASONS.get(why, why)))
    return chapters


CHAPTERS = _chapters()
STATEMENTS = {one.name: one for chapter in CHAPTERS.values() for one in chapter}
