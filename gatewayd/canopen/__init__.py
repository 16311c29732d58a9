"""The cell as a CANopen node: CiA 301 slave services, pure and clockless, and one asyncio shell around them."""
