# cmake -D folders=A;B -P empty_folders.cmake: make these folders anew.
file(REMOVE_RECURSE ${folders})
file(MAKE_DIRECTORY ${folders})
