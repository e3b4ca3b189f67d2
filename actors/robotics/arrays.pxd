# Types for C; arrays.py documents everything.

cpdef read_only(value)
cpdef array_of(numbers)
cpdef tuple floats(values)
cpdef bint all_finite(numbers) except -1
cpdef bint finite(array) except -1
cpdef joined(numbers, array)
cpdef stacked(rows, Py_ssize_t columns)
