"""Files of test programs as named columns: `read_file` reads any registered format."""
