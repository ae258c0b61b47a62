"""Files of test programs as named columns: `read_file` takes any registered format."""
