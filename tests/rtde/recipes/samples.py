"""Recipe files as the guides print them."""

GUIDE = """\
<?xml version="1.0"?>
<rtde_config>
  <recipe key="out">
    <field name="timestamp" type="DOUBLE"/>
    <field name="target_q" type="VECTOR6D"/>
    <field name="target_qd" type="VECTOR6D"/>
    <field name="speed_scaling" type="DOUBLE"/>
    <field name="output_int_register_0" type="INT32"/>
  </recipe>
  <recipe key="in1">
    <field name="input_int_register_0" type="INT32"/>
    <field name="input_int_register_1" type="INT32"/>
  </recipe>
  <recipe key="in2">
    <field name="input_double_register_0" type="DOUBLE"/>
  </recipe>
</rtde_config>
"""
"""The example of the older guide, "class rtde_config.ConfigFile"."""
