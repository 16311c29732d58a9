"""Small data sheets, and what vendors do to them."""

from __future__ import annotations

FILE = """\
[FileInfo]
FileName=encoder.eds
FileVersion=1
EDSVersion=4.0
ModificationDate=01-02-2024
ModificationTime=03:30PM
[DeviceInfo]
VendorName=Somebody
VendorNumber=0x1F0
ProductNumber=0x401
RevisionNumber=0x10002
BaudRate_500=1
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020196
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=3
[1018sub0]
ParameterName=Highest
DataType=0x0005
AccessType=const
DefaultValue=4
[1018sub1]
ParameterName=Vendor-ID
DataType=0x0007
AccessType=ro
DefaultValue=0x1F0
[1018sub2]
ParameterName=Product code
DataType=0x0007
AccessType=ro
[1800]
ParameterName=TPDO 1
ObjectType=0x9
SubNumber=3
[1800sub0]
ParameterName=Highest
DataType=0x0005
AccessType=const
DefaultValue=2
[1800sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x40000180
[1800sub2]
ParameterName=Transmission type
DataType=0x0005
AccessType=rw
DefaultValue=254
[1A00]
ParameterName=TPDO 1 mapping
ObjectType=0x9
SubNumber=2
[1A00sub0]
ParameterName=Number
DataType=0x0005
AccessType=rw
DefaultValue=1
[1A00sub1]
ParameterName=Object 1
DataType=0x0007
AccessType=rw
DefaultValue=0x60040020
[6004]
ParameterName=Position value
ObjectType=0x7
DataType=0x0007
AccessType=ro
PDOMapping=1
"""


def entry(index: str, kind: int, **keys: object) -> str:
    """A section of one object, by default a variable that a PDO may carry."""
    lines = {"ParameterName": f"Object {index}", "ObjectType": "0x7", "DataType": f"0x{kind:04X}"}
    lines |= {"AccessType": "rw", "PDOMapping": "1"} | {key: str(value) for key, value in keys.items()}
    return f"[{index}]\n" + "".join(f"{key}={value}\n" for key, value in lines.items())


DEVICE = FILE + "".join(
    (
        entry("1017", 6, PDOMapping=0, DefaultValue=0),
        entry("1014", 7, PDOMapping=0, DefaultValue="$NODEID+0x80"),
        entry("2000", 6, DefaultValue=0),
        entry("6200", 5, DefaultValue=0),
        entry("1400", 7, ObjectType="0x9", SubNumber=2),
        entry("1400sub0", 5, DefaultValue=1),
        entry("1400sub1", 7, DefaultValue="$NODEID+0x200"),
        entry("1400sub2", 5, DefaultValue=255),
        entry("1600", 7, ObjectType="0x9", SubNumber=2),
        entry("1600sub0", 5, DefaultValue=1),
        entry("1600sub1", 7, DefaultValue="0x62000008"),
    )
)
"""The sheet of the devices in `foreign_node`."""
