"""CAN frames between host and board: one schema, end-to-end protection, acknowledged commands."""
