# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""The same as order.py, in C: heaps of numbers and structures, and a table of times with open addressing."""

from cpython.mem cimport PyMem_Free, PyMem_Malloc, PyMem_Realloc

from epicycle.actors.core.moment cimport Moment, Wake

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

    cdef long long pop(self) except? -1:
        cdef long long* items = self.items
        cdef long long least = items[0], last
        cdef Py_ssize_t place = 0, below
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


cdef class Calendar:
    __slots__ = ("content",)

    def __cinit__(self):
        self.mask = -1
        self.heap = ReadyQueue()
        self.instants = []

    def __dealloc__(self):
        PyMem_Free(self.free)
        PyMem_Free(self.table)

    @property
    def content(self):
        return tuple((time, self.at(time)) for time in self.heap.content)

    @content.setter
    def content(self, instants):
        while self.size:
            self.pop()
        for time, instant in instants:  # which may not know its time yet
            self.put_in(time, instant)

    cdef long long first(self):
        return self.heap.items[0] if self.size else LAST

    cdef object at(self, long long time):
        cdef Py_ssize_t place
        if not self.size:
            return None
        place = hashed(time) & self.mask
        while self.table[place].number >= 0:
            if self.table[place].time == time:
                return self.instants[self.table[place].number]
            place = (place + 1) & self.mask
        return None

    cdef int add(self, Moment instant) except -1:
        return self.put_in(instant.time, instant)

    cdef int put_in(self, long long time, instant) except -1:
        cdef Py_ssize_t* free
        cdef Py_ssize_t number
        if self.size == self.room:
            free = <Py_ssize_t*>PyMem_Realloc(self.free, (2 * self.room + 8) * sizeof(Py_ssize_t))
            if free == NULL:
                raise MemoryError
            self.free, self.room = free, 2 * self.room + 8
        if 2 * self.size >= self.mask + 1:  # half full at most
            self._widen()
        if self.unused:
            self.unused -= 1
            number = self.free[self.unused]
            self.instants[number] = instant
        else:
            number = len(self.instants)
            self.instants.append(instant)
        self._put(time, number)
        self.size += 1
        return self.heap.push(time)

    cdef int _widen(self) except -1:
        cdef Slot* before = self.table
        cdef Py_ssize_t mask = self.mask, place
        cdef Slot* table = <Slot*>PyMem_Malloc((2 * mask + 2 if mask > 0 else 16) * sizeof(Slot))
        if table == NULL:
            raise MemoryError
        self.table = table
        self.mask = 2 * mask + 1 if mask > 0 else 15
        for place in range(self.mask + 1):
            table[place].number = -1
        for place in range(mask + 1):
            if before[place].number >= 0:
                self._put(before[place].time, before[place].number)
        PyMem_Free(before)
        return 0

    cdef void _put(self, long long time, Py_ssize_t number) noexcept:
        cdef Py_ssize_t place = hashed(time) & self.mask
        while self.table[place].number >= 0:
            place = (place + 1) & self.mask
        self.table[place].time = time
        self.table[place].number = number

    cdef object pop(self):
        cdef long long time = self.heap.pop()
        cdef Py_ssize_t place, below, home, number
        cdef object found
        self.size -= 1
        place = hashed(time) & self.mask
        while self.table[place].time != time or self.table[place].number < 0:
            place = (place + 1) & self.mask
        number = self.table[place].number
        found = self.instants[number]
        self.instants[number] = None
        self.free[self.unused] = number
        self.unused += 1
        # Later entries move up, so that no search ends too soon.
        below = place
        while True:
            below = (below + 1) & self.mask
            if self.table[below].number < 0:
                break
            home = hashed(self.table[below].time) & self.mask
            if (below - home) & self.mask >= (below - place) & self.mask:
                self.table[place] = self.table[below]
                place = below
        self.table[place].number = -1
        return found


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

    cpdef push(self, Wake wake, value):
        self.put(wake.time, wake.microstep, wake, value)

    cdef int put(self, long long time, long microstep, Wake wake, value) except -1:
        cdef Item item
        item.time, item.microstep, item.number = time, microstep, self.number
        self._insert(item, wake, value)
        self.number += 1
        return 0

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


cdef inline Py_ssize_t hashed(long long time) noexcept:
    cdef unsigned long long bits = <unsigned long long>time
    bits = (bits ^ (bits >> 29)) * <unsigned long long>0x9E3779B97F4A7C15
    return <Py_ssize_t>(bits >> 33)
