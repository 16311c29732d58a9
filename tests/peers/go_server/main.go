// A Modbus TCP server of the Go package simonvetter/modbus, with units 1 to 3.
// Usage: go_server ADDRESS:PORT. Prints "listening" once it serves.
//
// A register or coil that was never written reads as its address.
package main

import (
	"fmt"
	"io"
	"log"
	"os"
	"sync"
	"time"

	"github.com/simonvetter/modbus"
)

const units = 3

type handler struct {
	lock      sync.Mutex
	registers [units + 1]map[uint16]uint16
	coils     [units + 1]map[uint16]bool
}

func (h *handler) known(unit uint8) bool {
	return unit >= 1 && unit <= units
}

func (h *handler) HandleCoils(req *modbus.CoilsRequest) ([]bool, error) {
	if !h.known(req.UnitId) {
		return nil, modbus.ErrGWTargetFailedToRespond
	}
	h.lock.Lock()
	defer h.lock.Unlock()
	found := make([]bool, 0, req.Quantity)
	for i := uint16(0); i < req.Quantity; i++ {
		if req.IsWrite {
			h.coils[req.UnitId][req.Addr+i] = req.Args[i]
		}
		found = append(found, h.coils[req.UnitId][req.Addr+i])
	}
	return found, nil
}

func (h *handler) HandleDiscreteInputs(req *modbus.DiscreteInputsRequest) ([]bool, error) {
	if !h.known(req.UnitId) {
		return nil, modbus.ErrGWTargetFailedToRespond
	}
	return make([]bool, req.Quantity), nil
}

func (h *handler) HandleHoldingRegisters(req *modbus.HoldingRegistersRequest) ([]uint16, error) {
	if !h.known(req.UnitId) {
		return nil, modbus.ErrGWTargetFailedToRespond
	}
	h.lock.Lock()
	defer h.lock.Unlock()
	found := make([]uint16, 0, req.Quantity)
	for i := uint16(0); i < req.Quantity; i++ {
		address := req.Addr + i
		if req.IsWrite {
			h.registers[req.UnitId][address] = req.Args[i]
		}
		value, written := h.registers[req.UnitId][address]
		if !written {
			value = address
		}
		found = append(found, value)
	}
	return found, nil
}

func (h *handler) HandleInputRegisters(req *modbus.InputRegistersRequest) ([]uint16, error) {
	if !h.known(req.UnitId) {
		return nil, modbus.ErrGWTargetFailedToRespond
	}
	return make([]uint16, req.Quantity), nil
}

func main() {
	h := &handler{}
	for unit := range h.registers {
		h.registers[unit] = map[uint16]uint16{}
		h.coils[unit] = map[uint16]bool{}
	}
	server, err := modbus.NewServer(&modbus.ServerConfiguration{
		URL:        "tcp://" + os.Args[1],
		Timeout:    time.Minute,
		MaxClients: 8,
		Logger:     log.New(io.Discard, "", 0),
	}, h)
	if err == nil {
		err = server.Start()
	}
	if err != nil {
		fmt.Fprintln(os.Stderr, err)
		os.Exit(1)
	}
	fmt.Println("listening")
	select {}
}
