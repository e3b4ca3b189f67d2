# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""The same as order.py, in C: heaps of numbers and structures."""

from cpython.mem cimport PyMem_Free, PyMem_Malloc, PyMem_Realloc

from epicycle.actors.core.tag cimport Wake

NEVER = 2**63 - 1
cdef long long LAST = 2**63 - 1


cdef class ReadyQueue:
    __slots__ = ("content",)

    def __dealloc__(self):
        PyMem_Free(self.items)

    @property
    def content(self):
        return [self.items[place] for place in range(self.size)]

    @content.setter
    def content(self, ranks):
        self.size = 0
        for rank in ranks:
            self.push(rank)

    cdef int push(self, long long rank) except -1:
        cdef Py_ssize_t place = self.size, above
        cdef long long* items = self.items
        if self.size == self.room:
            items = <long long*>PyMem_Realloc(items, (2 * self.room + 8) * sizeof(long long))
            if items == NULL:
                raise MemoryError
            self.items, self.room = items, 2 * self.room + 8
        self.size += 1
        while place > 0:
            above = (place - 1) >> 1
            if items[above] <= rank:
                break
            items[place] = items[above]
            place = above
        items[place] = rank
        return 0

    cdef long long pop(self) noexcept:
        cdef long long* items = self.items
        cdef long long least, last
        cdef Py_ssize_t place = 0, below
        if not self.size:
            return -1
        least = items[0]
        self.size -= 1
        last = items[self.size]
        while True:
            below = 2 * place + 1
            if below >= self.size:
                break
            if below + 1 < self.size and items[below + 1] < items[below]:
                below += 1
            if items[below] >= last:
                break
            items[place] = items[below]
            place = below
        items[place] = last
        return least


cdef class TimedQueue:
    __slots__ = ("content", "number")

    def __cinit__(self):
        self.wakes, self.values = [], []

    def __dealloc__(self):
        PyMem_Free(self.heap)
        PyMem_Free(self.free)

    def __len__(self):
        return self.size

    @property
    def content(self):
        return tuple(
            (
                self.heap[place].time,
                self.heap[place].microstep,
                self.heap[place].number,
                self.wakes[self.heap[place].place],
                self.values[self.heap[place].place],
            )
            for place in range(self.size)
        )

    @content.setter
    def content(self, entries):
        cdef Item item
        self.size = self.unused = 0
        self.wakes, self.values = [], []
        for time, microstep, number, wake, value in entries:
            item.time, item.microstep, item.number = time, microstep, number
            self._insert(item, wake, value)

    cdef long long first(self) noexcept:
        return self.heap[0].time if self.size else LAST

    cpdef push(self, Wake wake, value):
        self.put(wake.time, wake.microstep, wake, value)

    cdef Py_ssize_t put(self, long long time, long microstep, Wake wake, value) except -1:
        cdef Item item
        item.time, item.microstep, item.number = time, microstep, self.number
        self._insert(item, wake, value)
        self.number += 1
        return self.size

    cdef int _insert(self, Item item, wake, value) except -1:
        cdef Py_ssize_t place, above
        cdef Item* heap = self.heap
        cdef Py_ssize_t* free
        if self.size == self.room:
            heap = <Item*>PyMem_Realloc(heap, (2 * self.room + 4) * sizeof(Item))
            if heap == NULL:
                raise MemoryError
            self.heap = heap
            free = <Py_ssize_t*>PyMem_Realloc(self.free, (2 * self.room + 4) * sizeof(Py_ssize_t))
            if free == NULL:
                raise MemoryError
            self.free, self.room = free, 2 * self.room + 4
        if self.unused:
            self.unused -= 1
            item.place = self.free[self.unused]
            self.wakes[item.place], self.values[item.place] = wake, value
        else:
            item.place = len(self.values)
            self.wakes.append(wake)
            self.values.append(value)
        place = self.size
        self.size += 1
        while place > 0:
            above = (place - 1) >> 1
            if not before(item, heap[above]):
                break
            heap[place] = heap[above]
            place = above
        heap[place] = item
        return 0

    cpdef bint is_due(self) except -1:
        return self.size > 0 and (<Wake>self.wakes[self.heap[0].place]).due

    cpdef list due(self):
        cdef list values = []
        while self.is_due():
            values.append(self.pop())
        return values

    cdef bint is_before(self, long long time, long microstep) noexcept:
        """Whether the first waits for this tag, or for an earlier one."""
        cdef Item* heap = self.heap
        if not self.size:
            return False
        return heap[0].time < time or (heap[0].time == time and heap[0].microstep <= microstep)

    cpdef pop(self):
        cdef Item* heap = self.heap
        cdef Item last
        cdef Py_ssize_t place = 0, below, found
        cdef object value
        if not self.size:
            raise IndexError("the line is empty")
        found = heap[0].place
        self.size -= 1
        last = heap[self.size]
        while True:
            below = 2 * place + 1
            if below >= self.size:
                break
            if below + 1 < self.size and before(heap[below + 1], heap[below]):
                below += 1
            if not before(heap[below], last):
                break
            heap[place] = heap[below]
            place = below
        heap[place] = last
        value = self.values[found]
        self.wakes[found] = self.values[found] = None
        self.free[self.unused] = found
        self.unused += 1
        return value


cdef inline bint before(Item one, Item other) noexcept:
    if one.time != other.time:
        return one.time < other.time
    if one.microstep != other.microstep:
        return one.microstep < other.microstep
    return one.number < other.number
