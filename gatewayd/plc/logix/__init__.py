"""Logix controllers: data types, routines and tags in the forms that Studio 5000 imports."""
