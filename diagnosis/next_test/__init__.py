"""The next test: measurements that separate explanations which the present data cannot distinguish."""
