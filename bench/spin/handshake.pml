/* A feeder hands parts to a press, as in handshake.yaml; with -DSTUCK as in handshake_stuck.yaml. */
#define PARTS 1000
#define T_PRESS 10 /* periods: 1 s at 10 Hz */

mtype = { offering, withdrawing, asking, finished, waiting, pressing, pressed };
mtype feeder_state = offering, press_state = waiting;
bool ready, done;
short n;

active proctype feeder()
{
offer:
	atomic { feeder_state = offering; ready = true }
	atomic { done -> feeder_state = withdrawing; n++; ready = false }
withdrawn:
	if
	:: atomic { !done && n >= PARTS -> feeder_state = finished }
#ifdef STUCK
	:: atomic { !done && n == PARTS / 2 -> feeder_state = asking };
	   atomic { done -> feeder_state = withdrawing; n++ };
	   goto withdrawn
	:: !done && n < PARTS && n != PARTS / 2 -> goto offer
#else
	:: !done && n < PARTS -> goto offer
#endif
	fi
}

active proctype press()
{
	byte t;
end:	/* it may wait for ever once the feeder has finished */
	do
	:: atomic { ready -> press_state = pressing; t = 0 };
	   do
	   :: t < T_PRESS -> t++
	   :: atomic { press_state = pressed; done = true; break } /* the ram is down, or it is time */
	   od;
	   atomic { !ready -> press_state = waiting; done = false }
	od
}

ltl no_more { [] (n <= PARTS) }
ltl held { [] (press_state == pressing -> feeder_state == offering) }
ltl whole { [] (feeder_state == finished -> n == PARTS) }
ltl answered { [] (feeder_state == offering -> <> (feeder_state != offering)) }
ltl fewer { [] (n < PARTS) }
