"""Pictures, films and the page that plays a result in a browser."""
