from epicycle.actors.core.inbox cimport Inbox, Moment, Wake, new_wake
from epicycle.actors.core.order cimport Line, Ranks, Times
