"""Programs that measure this package itself and write pages of docs/. They need its source tree and are not installed."""
