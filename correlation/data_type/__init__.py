"""Types of measured data beside steady states and time records, one per file; `registry.DATA_TYPES` finds them."""
