/* Made by tests/model/permission_model.py from haptic_server.permission and processes.pml; do not edit. */

#define FREE 0
#define PANICKED 1
#define FAULTED 2
#define MAY_PUSH(s) ((s) == 0 -> 1 : ((s) == 1 -> 0 : (0)))
#define AFTER_PANIC(s) ((s) == 0 -> 1 : ((s) == 1 -> 1 : (2))) /* panic */
#define AFTER_FAULT(s) ((s) == 0 -> 2 : ((s) == 1 -> 2 : (2))) /* fault */
#define AFTER_ARM(s) ((s) == 0 -> 0 : ((s) == 1 -> 0 : (0))) /* arm */
#define AFTER_SERVO(s) ((s) == 0 -> 0 : ((s) == 1 -> 1 : (2))) /* servo restarts */

/*
 * Who touches the permission to push, and the one thing that must never be: force in a tick that began after a panic or
 * a fault, without an arm typed at the machine since.
 *
 * Every process may be killed before each of its steps, as often as one likes, and is started again. A panic has
 * happened when the gateway has added it in the block in place, and the gateway is not done before that; a fault, when
 * the servo has stored that it is held. What dies before that has told nobody.
 */

#define NONE 2
#define OLD 3      /* a block that no servo will look into any more: what stands in it does not matter */

/* `panic`: how many there were since the servo last said how many it has seen. Two blocks: in place, and the next. */
typedef Block { byte panic; byte held; bit arm } /* held: the state in which its servo is */
Block block[2];
byte place = NONE;   /* the block that lies in the run folder */
byte seen;           /* of those in its block, how many the running servo has seen */
byte own = NONE;     /* the starting or running servo's */
byte before = NONE;  /* the one that the starting servo found in place */
byte mapped = NONE;  /* the gateway's */
byte raised = NONE;  /* where the gateway raises a panic just now */
bit owed;            /* a panic or a fault has happened since the last arm */
bit due;             /* ... before this tick began */

#define IS_HELD(b) (block[b].panic != 0 || block[b].held != FREE)
#define LAST_WORD(b) (block[b].held != FREE -> block[b].held : (block[b].panic != 0 -> PANICKED : FREE))
#define IS_LOOKED_AT(b) (b == place || b == own || b == before || b >= NONE)

/* After a block was left: who still has it, has an old one. */
inline leave() {
	if
	:: !IS_LOOKED_AT(mapped) -> mapped = OLD
	:: else
	fi;
	if
	:: !IS_LOOKED_AT(raised) -> raised = OLD
	:: else
	fi
}

inline clear(b) {
	block[b].panic = 0;
	block[b].held = 0;
	block[b].arm = 0
}

/* A second panic beside one that nobody has seen changes nothing, so it is not counted. */
inline add_panic(b) {
	if
	:: b < NONE && block[b].panic == (b == own -> seen : 0) -> block[b].panic++
	:: else
	fi
}

active proctype servo() {
	byte state;
	byte held;
	bit panic, arm, news;
starts:
	/* its supervisor may lay out another scene first, unless the servo was held */
	if
	:: place != NONE && !IS_HELD(place) ->
		if
		:: skip /* another scene: the block stays where it is */
		:: goto dies
		fi
	:: true
	fi;
	/* a new block, held until more is known */
	d_step {
		before = place;
		own = (place == 0 -> 1 : 0);
		block[own].held = PANICKED
	};
	if
	:: place = own
	:: goto dies
	fi;
	/* now that nobody finds the old one any more: its last word */
	if
	:: held = (before != NONE -> LAST_WORD(before) : FREE)
	:: goto dies
	fi;
	if
	:: d_step {
		block[own].held = held;
		state = AFTER_SERVO(held);
		held = 0;
		if
		:: before != NONE -> clear(before)
		:: else
		fi;
		before = NONE;
		leave()
	}
	:: goto dies
	fi;
ticks:
	if
	:: due = owed
	:: goto dies
	fi;
	if
	:: d_step { panic = (block[own].panic != 0); seen = block[own].panic }
	:: goto dies
	fi;
	if
	:: d_step { arm = block[own].arm; block[own].arm = 0 }
	:: goto dies
	fi;
	d_step {
		if
		:: panic -> state = AFTER_PANIC(state)
		:: !panic && arm -> state = AFTER_ARM(state)
		:: else
		fi;
		panic = 0;
		arm = 0
	};
	if
	:: true
	:: d_step { news = (state != FAULTED); state = AFTER_FAULT(state) }
	:: goto dies
	fi;
	if
	:: d_step {
		block[own].held = state;
		if
		:: news -> owed = 1; due = 1
		:: else
		fi
	}
	:: goto dies
	fi;
	if
	:: d_step { block[own].panic = block[own].panic - seen; seen = 0 }
	:: goto dies
	fi;
	assert(!(MAY_PUSH(state) && due)); /* the force goes out to the motors */
	if
	:: d_step {
		if
		:: news -> block[own].arm = 0 /* before the fault is told */
		:: else
		fi;
		news = 0
	}
	:: goto dies
	fi;
	goto ticks;
dies:
	skip;
	d_step {
		if
		:: own != NONE && own != place -> clear(own)
		:: else
		fi;
		own = NONE;
		if
		:: before != NONE && before != place -> clear(before)
		:: else
		fi;
		before = NONE;
		leave();
		due = 0; state = 0; seen = 0; panic = 0; arm = 0; news = 0; held = 0
	};
	goto starts
}

active proctype gateway() {
	bit added, counted;
starts:
	skip;
	d_step { place != NONE -> mapped = place };
	do
	/* a panic comes */
	:: raised == NONE -> raised = mapped
	:: d_step {
		raised != NONE && !added ->
		add_panic(raised);
		added = 1;
		if
		:: raised == place -> owed = 1; counted = 1
		:: else
		fi
	}
	/* in place all the time? else once more, in the new one */
	:: d_step {
		raised != NONE && added ->
		raised = (raised == place -> NONE : place);
		added = 0;
		if
		:: raised == NONE && !counted -> owed = 1 /* done, and raised nowhere that counts */
		:: else
		fi;
		counted = 0
	}
	/* a new servo's block is taken up, perhaps with the panic of the old one */
	:: d_step { place != NONE && mapped != place -> mapped = place }
	:: d_step { place != NONE && mapped != place -> mapped = place; add_panic(mapped) }
	:: d_step { mapped = NONE; raised = NONE; added = 0; counted = 0 }; goto starts
	od
}

active proctype operator() {
	do
	:: d_step { place != NONE -> block[place].arm = 1; owed = 0; due = 0 }
	od
}
